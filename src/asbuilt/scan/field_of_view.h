// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::scan {

/// The sides of the sensor's field of view, as far as a scan shows them. A camera's field is a rectangle in the image,
/// and what it cuts off ends along straight lines; what ends by itself seldom does. Beyond such a line nobody looked:
/// that nothing was measured there speaks for nothing. Const after construction.
///
/// The image is the plane across the mean ray (gnomonic), or across parallel rays. Of the rectangles around all
/// measurements the one whose sides these touch along the greatest length is taken, and of its sides those that are
/// touched along at least `kTouched`. A scan that reaches further than 70 degrees from its mean ray (a scanner that
/// turns) has no such sides.
class FieldOfView {
 public:
  static constexpr double kTouched = 0.4;  ///< share of a side's length

  /// `spacing_mm` is the distance between neighbouring points at their median range. Precondition: viewpoint.known().
  FieldOfView(std::span<const Eigen::Vector3f> points_in_scan, double spacing_mm, const Viewpoint& viewpoint);

  /// Whether the point lies beyond one of the sides, by more than the distance of neighbouring rays.
  [[nodiscard]] bool is_outside(const Eigen::Vector3d& point_in_scan) const;

  /// How many sides the scan shows: 0 to 4.
  [[nodiscard]] int sides() const { return static_cast<int>(sides_.size()); }

 private:
  struct Side {
    Eigen::Vector3d outwards;  // unit length
    double offset_mm;          // of the plane from the viewpoint, along it: 0 where rays meet
  };
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<Side> sides_;
};

}  // namespace asbuilt::scan
