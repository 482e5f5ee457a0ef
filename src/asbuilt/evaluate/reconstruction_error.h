// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/surface_distance.h"

namespace asbuilt::evaluate {

/// Points of a cloud far from the true surface.
struct PointsBeyond {
  std::size_t points = 0;  ///< finite ones
  std::size_t beyond = 0;  ///< of these, further from the surface than was asked

  [[nodiscard]] double share() const {
    return points == 0 ? 0.0 : static_cast<double>(beyond) / static_cast<double>(points);
  }
};
[[nodiscard]] PointsBeyond points_beyond(std::span<const Eigen::Vector3d> points, double distance_mm,
                                         const model::SurfaceDistance& surface, const Context& context);

/// Share of the surface that `reference` covers which `cloud` covers, too, in [0, 1]; 1 where `reference` covers
/// nothing. Over surface area: even samples of the mesh, half a `reach_mm` apart. A cloud covers a sample if the foot
/// of one of its points lies within `reach_mm` of it on a face that looks to the same side: the two sides of a sheet
/// are covered each on its own. Deterministic.
[[nodiscard]] double completeness(std::span<const Eigen::Vector3d> cloud, std::span<const Eigen::Vector3d> reference,
                                  double reach_mm, const TriangleMesh& mesh, const model::SurfaceDistance& surface,
                                  const Context& context);

}  // namespace asbuilt::evaluate
