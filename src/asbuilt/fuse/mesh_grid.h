// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/context.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/fuse/mesh_field.h"

namespace asbuilt::fuse {

/// The zero set of a field near its samples, as far as they support it.
///
/// Heights are taken at the nodes of a grid, kept in sparse bricks of 8 x 8 x 8, near samples only. Each cell gets one
/// vertex for each piece of surface in it (two for the two sides of a thin wall): the point nearest to the tangent
/// planes where the piece crosses the cell's edges, which is on the edge or corner of the part if there is one. Each
/// crossed edge of the grid whose crossing is supported gives a quad between the four cells around it.
[[nodiscard]] TriangleMesh supported_surface(const SurfaceField& field, const FieldSamples& samples, double cell_mm,
                                             double max_hole_widths, const Context& context);

}  // namespace asbuilt::fuse
