// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/refine/correspondences.h"
#include "asbuilt/refine/normal_equations.h"

namespace asbuilt::refine {

/// The gradient of Eq. 5 cut into cubes of edge `cell_mm`, ordered by cell, then by link. `edges` holds two a link,
/// there and back. Errors of neighbouring matches are alike (they share points, normals, edges and curvature), those of
/// different cubes hardly, so that the spread of the cubes' gradients tells how well the poses are known. Any number of
/// threads gives the same bytes.
[[nodiscard]] std::vector<CellGradient> cell_gradients(std::span<const DirectedEdge> edges,
                                                       std::span<const SampledView> views, std::span<const Pose> poses,
                                                       const Scaling& scaling, bool symmetric, double cell_mm,
                                                       const Context& context);

}  // namespace asbuilt::refine
