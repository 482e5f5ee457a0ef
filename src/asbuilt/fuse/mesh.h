// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/fuse/fuse.h"

namespace asbuilt::fuse {

struct MeshOptions {
  double cell_mm = 0.0;            ///< grid the surface is drawn on; 0: 1.25 spacings of the cloud, more if it is noisy
  double max_hole_spacings = 2.0;  ///< places further than this from all samples stay open, in [0.8, 2.2]
  int min_component_triangles = 32;  ///< smaller pieces that hang loose are left out; 0 keeps all

  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(MeshOptions& options, Visitor&& field) {
  field("cell", options.cell_mm, "grid of the surface mesh, mm (0: 1.25 spacings of the cloud)");
  field("max_hole_spacings", options.max_hole_spacings, "places further than this from all samples stay open");
  field("min_component_triangles", options.min_component_triangles, "smaller loose pieces are left out");
}

/// A surface mesh of the part as built, in the model frame, mm: open where nothing was scanned.
///
/// The zero set of a moving-least-squares height (mesh_field.h) on a sparse grid, one vertex for each piece of surface
/// in a cell, pulled onto edges (mesh_grid.h). Triangles wind counter-clockwise seen from where the normals point. No
/// edge has more than two triangles. The two sides of a wall stay apart; a wall thinner than a cell may be left open.
///
/// Not in the paper, which shows clouds. Same bytes for any number of threads. Cost O(n log n), memory O(n).
/// Errors: invalid_argument (options, normals missing, values that are not finite, a cell that does not fit the cloud),
/// not_possible (fewer than 20 points, or no two of them make a surface), cancelled.
[[nodiscard]] Result<TriangleMesh> surface_mesh(const Reconstruction& reconstruction, const MeshOptions& options,
                                                const Context& context);

}  // namespace asbuilt::fuse
