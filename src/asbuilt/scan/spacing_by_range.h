// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::scan {

/// Distance between neighbouring measurements as it changes with the distance from the sensor. A scanner that turns,
/// and a camera, measure in even steps of angle: what stands near is sampled more densely than the scan at its median.
/// Points thinned by a grid are as far apart everywhere. Both are read off the points, so nothing is assumed.
class SpacingByRange {
 public:
  /// Knows nothing.
  SpacingByRange() = default;

  /// Medians over bands of range that hold equally many points. Knows nothing without a viewpoint that is a point, or
  /// if there are too few points for two bands. `tree` is of `points_in_scan`.
  SpacingByRange(std::span<const Eigen::Vector3f> points_in_scan, const KdTree& tree, const Viewpoint& viewpoint);

  [[nodiscard]] bool known() const { return !ranges_mm_.empty(); }

  /// Distance between neighbours, mm, at a place of the scan; between the middles of bands in proportion, beyond the
  /// first and the last as there. Precondition: known().
  [[nodiscard]] double at(const Eigen::Vector3d& point_in_scan) const;

  /// The same of the points in a mirror at x = 0.
  [[nodiscard]] SpacingByRange mirrored() const {
    SpacingByRange result = *this;
    result.viewpoint_.x() = -viewpoint_.x();
    return result;
  }

 private:
  Eigen::Vector3d viewpoint_ = Eigen::Vector3d::Zero();
  std::vector<double> ranges_mm_, spacings_mm_;  // of the bands; ranges increase
};

}  // namespace asbuilt::scan
