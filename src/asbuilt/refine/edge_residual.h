// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "asbuilt/core/pose.h"
#include "asbuilt/refine/correspondences.h"
#include "asbuilt/refine/point_to_plane.h"

namespace asbuilt::refine {

/// The residual of a match, with positions relative to `origin` (which keeps the rotation columns small).
class EdgeResidualFunction {
 public:
  EdgeResidualFunction(const DirectedEdge& edge, std::span<const SampledView> views, std::span<const Pose> poses,
                       const Eigen::Vector3d& origin, bool symmetric)
      : source_(edge.of_rims ? views[static_cast<std::size_t>(edge.source)].rims.ends
                             : views[static_cast<std::size_t>(edge.source)].points),
        target_(views[static_cast<std::size_t>(edge.target)].points),
        source_pose_(poses[static_cast<std::size_t>(edge.source)]),
        target_pose_(poses[static_cast<std::size_t>(edge.target)]),
        origin_(origin),
        symmetric_(symmetric && !edge.of_rims) {}

  [[nodiscard]] Eigen::Vector3d position(const Match& match) const {
    return source_pose_ * source_.positions[match.source].cast<double>() - origin_;
  }

  [[nodiscard]] ResidualWithJacobian operator()(const Match& match) const {
    const Eigen::Vector3d p = position(match);
    const Eigen::Vector3d q = target_pose_ * target_.positions[match.target].cast<double>() - origin_;
    const Eigen::Vector3d normal_q = target_pose_.linear() * target_.normals[match.target].cast<double>();
    if (!symmetric_) return point_to_plane(p, q, normal_q);
    const Eigen::Vector3d normal_p = source_pose_.linear() * source_.normals[match.source].cast<double>();
    return symmetric_point_to_plane(p, normal_p, q, normal_q);
  }

 private:
  const PointCloud& source_;
  const PointCloud& target_;
  const Pose& source_pose_;
  const Pose& target_pose_;
  Eigen::Vector3d origin_;
  bool symmetric_;
};

}  // namespace asbuilt::refine
