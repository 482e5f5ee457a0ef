// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/fuse/point_grid.h"

namespace asbuilt::fuse {

/// Samples of a surface in an order that keeps neighbours together, with the width each needs.
struct FieldSamples {
  PointCloud cloud;
  std::vector<float> width_mm;  ///< local spacing, or what the noise or the grid asks for if that is more
  double base_width_mm = 0.0;   ///< the smallest of them
};

/// Measures spacing and noise around each sample. `cell_mm` = 0: not stated. Widths are 0 where all points coincide.
[[nodiscard]] FieldSamples field_samples(const PointCloud& cloud, double known_sigma_mm, double cell_mm,
                                         const Context& context);

/// Height over the surface near a place, positive on the side the normals point to.
struct FieldValue {
  float height = 0.0F;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float nearest = 0.0F;    ///< distance to the nearest sample that was used, in widths
  int samples = 0;         ///< that were used
  float imbalance = 0.0F;  ///< 0: samples all around; 1: all in one direction
};

/// Height over the surface that samples stand for, by moving least squares on the samples that face like a given one.
///
/// A sample's plane and the mean plane err on a curved surface by the same amount in opposite directions, so their mean
/// is used: spheres keep their radius. Where a second face is near, the two are joined as the edge between them says:
/// the larger height at an outer edge, the smaller one at an inner. Faces that look the other way have no say.
class SurfaceField {
 public:
  SurfaceField(const FieldSamples& samples, const Context& context);

  struct Near {
    std::uint32_t index;
    float closeness;  ///< 1 at the foot, 0 at the end of the reach
  };
  using Scratch = std::vector<Near>;  ///< memory that a thread reuses

  /// The height at `place` over the surface around sample `reference`; nothing where no sample is near its foot.
  [[nodiscard]] std::optional<FieldValue> at(const Eigen::Vector3f& place, std::uint32_t reference,
                                             Scratch& scratch) const;

  static constexpr float kReachInWidths = 2.2F;  ///< samples further from the foot have no weight

 private:
  const FieldSamples& samples_;
  PointGrid fine_, coarse_;  // for samples of base width, and for the wider ones
};

}  // namespace asbuilt::fuse
