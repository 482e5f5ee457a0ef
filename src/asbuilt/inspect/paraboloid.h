// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace asbuilt::inspect {

/// Where a paraboloid is highest, or lowest.
struct Extremum {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double height = 0.0;
  double variance = 0.0;  ///< of the height, from the scatter of what it was fitted to
};

/// Fits a paraboloid to heights (z) over places (x, y) within 1 of the origin, outliers left out, and gives its
/// extremum towards `sign`: its top, if it is a cap whose top lies within 0.5 of the origin, else what it is at the
/// origin. Nothing, if the places do not determine it.
[[nodiscard]] std::optional<Extremum> extremum_of_paraboloid(std::span<const Eigen::Vector3d> points, double sign);

}  // namespace asbuilt::inspect
