// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "asbuilt/core/pose.h"

namespace asbuilt::detect {

/// Point pair feature of two oriented points (Eq. 6), d = p_i - p_j.
struct PointPairFeature {
  float distance;   ///< |d|, mm
  float angle_i_d;  ///< angle(n_i, d), radians in [0, pi]
  float angle_j_d;  ///< angle(n_j, d)
  float angle_i_j;  ///< angle(n_i, n_j)
};

/// Normals are unit length; the points differ.
[[nodiscard]] PointPairFeature point_pair_feature(const Eigen::Vector3f& point_i, const Eigen::Vector3f& normal_i,
                                                  const Eigen::Vector3f& point_j, const Eigen::Vector3f& normal_j);

/// The local coordinate frame of a reference point: it at the origin, its normal along +x. The rotation is the
/// smallest one that does so.
[[nodiscard]] Pose local_frame(const Eigen::Vector3f& point, const Eigen::Vector3f& normal);

/// Angle of a point about the x axis of a local frame: atan2(z, y), in (-pi, pi].
[[nodiscard]] float angle_in_frame(const Eigen::Matrix3f& rotation, const Eigen::Vector3f& offset_from_reference);

/// The pose that one correspondence of reference points and a rotation alpha about the normal fix:
/// local_frame(scene)^-1 * R_x(alpha) * local_frame(model) takes model to scan; this is its inverse.
[[nodiscard]] Pose model_from_scan_of(const Pose& model_frame, const Pose& scene_frame, double alpha);

/// How features fall into bins, and which bins lie nearest to a feature.
struct Quantisation {
  float distance_step = 1.0F;  ///< mm
  int distance_bins = 1;
  int angle_bins = 15;  ///< over [0, pi]

  [[nodiscard]] std::uint32_t bin_count() const {
    return static_cast<std::uint32_t>(distance_bins * angle_bins * angle_bins * angle_bins);
  }

  static constexpr std::uint32_t kNoBin = 0xffffffffU;
  /// The bin of a feature; kNoBin if it is longer than the longest pair of the model.
  [[nodiscard]] std::uint32_t bin(const PointPairFeature& feature) const;

  static constexpr int kMostNeighbours = 16;
  struct Bins {
    std::array<std::uint32_t, kMostNeighbours> bin;
    int count = 0;
  };
  /// The `wanted` bins that a feature most likely belongs to when noise moves it (the F_ri of Sec. 3.1): its own, then
  /// those across the borders it lies closest to. `reach` is how close to a border, in bins (0.5: every neighbour on
  /// the nearer side), a value must lie for the bin beyond to count. Bins that do not exist are left out.
  [[nodiscard]] Bins soft_bins(const PointPairFeature& feature, int wanted, float reach) const;
};

}  // namespace asbuilt::detect
