// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <functional>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::simulate {

/// A solid given by a function that is negative inside and roughly a distance near the surface.
using Solid = std::function<double(const Eigen::Vector3d&)>;

/// The surface of a solid as a closed triangle mesh, faces outward: dual contouring (Ju et al. 2002) on cubes of
/// `cell_mm`, which keeps sharp edges that marching cubes would cut off. `box` must hold the whole solid.
/// Walls thinner than two cells may pinch. Cost: one evaluation a grid node, about forty a cell on the surface.
[[nodiscard]] TriangleMesh surface_of(const Solid& solid, const Eigen::AlignedBox3d& box, double cell_mm);

}  // namespace asbuilt::simulate
