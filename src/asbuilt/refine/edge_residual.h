// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "asbuilt/core/pose.h"
#include "asbuilt/refine/correspondences.h"
#include "asbuilt/refine/point_to_plane.h"

namespace asbuilt::refine {

/// The residual of a match, in the frame of the edge's target with positions relative to `origin_in_common` (which
/// keeps the rotation columns small). There a match takes one motion instead of three, and the residual is the same
/// number. rotation() takes what is derived and summed there to the common frame.
class EdgeResidualFunction {
 public:
  EdgeResidualFunction(const DirectedEdge& edge, std::span<const SampledView> views, std::span<const Pose> poses,
                       const Eigen::Vector3d& origin_in_common, bool symmetric)
      : source_(edge.of_rims ? views[static_cast<std::size_t>(edge.source)].rims.ends
                             : views[static_cast<std::size_t>(edge.source)].points),
        target_(views[static_cast<std::size_t>(edge.target)].points),
        matches_(edge.matches),
        rotation_(poses[static_cast<std::size_t>(edge.target)].linear()),
        symmetric_(symmetric && !edge.of_rims) {
    const Pose target_from_common = poses[static_cast<std::size_t>(edge.target)].inverse(Eigen::Isometry);
    const Pose target_from_source = target_from_common * poses[static_cast<std::size_t>(edge.source)];
    turn_ = target_from_source.linear();
    origin_ = target_from_common * origin_in_common;
    shift_ = target_from_source.translation() - origin_;
  }

  /// The axes of the target's frame in the common one.
  [[nodiscard]] const Eigen::Matrix3d& rotation() const { return rotation_; }

  /// The point of the source, from the origin, in the target's frame.
  [[nodiscard]] Eigen::Vector3d position(std::size_t match) const {
    return turn_ * source_.positions[matches_[match].source].cast<double>() + shift_;
  }

  [[nodiscard]] double residual(std::size_t match) const {
    const Eigen::Vector3d offset = position(match) - target_position(match);
    if (!symmetric_) return target_normal(match).dot(offset);
    return 0.5 * (source_normal(match) + target_normal(match)).dot(offset);
  }

  [[nodiscard]] ResidualWithJacobian operator()(std::size_t match) const {
    const Eigen::Vector3d p = position(match), q = target_position(match), normal_q = target_normal(match);
    return symmetric_ ? symmetric_point_to_plane(p, source_normal(match), q, normal_q) : point_to_plane(p, q, normal_q);
  }

  /// Sources come in their order, targets do not: asked for some matches ahead they are there when it is their turn.
  void fetch_ahead(std::size_t match) const {
    constexpr std::size_t kAhead = 16;
    const std::uint32_t target = matches_[std::min(match + kAhead, matches_.size() - 1)].target;
    __builtin_prefetch(&target_.positions[target]);
    __builtin_prefetch(&target_.normals[target]);
  }

 private:
  [[nodiscard]] Eigen::Vector3d target_position(std::size_t match) const {
    return target_.positions[matches_[match].target].cast<double>() - origin_;
  }
  [[nodiscard]] Eigen::Vector3d target_normal(std::size_t match) const {
    return target_.normals[matches_[match].target].cast<double>();
  }
  [[nodiscard]] Eigen::Vector3d source_normal(std::size_t match) const {
    return turn_ * source_.normals[matches_[match].source].cast<double>();
  }

  const PointCloud& source_;
  const PointCloud& target_;
  std::span<const Match> matches_;
  Eigen::Matrix3d rotation_, turn_;
  Eigen::Vector3d origin_, shift_;  // in the target's frame
  bool symmetric_;
};

}  // namespace asbuilt::refine
