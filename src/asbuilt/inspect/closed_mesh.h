// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/inspect/spots.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::inspect {

/// The part as built without holes, in the model frame, mm. Invariant: `deviation_mm` and `filled` have an entry a
/// vertex.
struct ClosedMesh {
  TriangleMesh mesh;                 ///< outwards; cad_faces, where the model has them, are -1 where a hole was closed
  std::vector<float> deviation_mm;   ///< NaN where nothing was measured
  std::vector<std::uint8_t> filled;  ///< 1 where nothing was measured: a guess
  std::size_t holes_closed = 0;      ///< of the model's skin
};

struct ClosedMeshOptions {
  double edge_length_mm = 0.0;          ///< longer edges of the skin are split; 0: none is
  std::size_t max_triangles = 1000000;  ///< longer edges stay, to keep within it
  double return_length_ratio = 0.05;    ///< over this share of the diameter what is filled returns to the CAD
};

/// The skin of the CAD, its edges split down, moved onto what was measured: every vertex along the normals of its faces
/// by their deviations, so that sharp edges stay sharp. Where nothing was measured the surface leaves the rim of what
/// was with its displacement and returns to the CAD (a screened Laplace equation on the mesh). Holes of the skin are
/// closed by a fan each. Every edge is run as often one way as the other: the mesh is watertight.
///
/// What the CAD does not have shows only as far as it can be told as a deviation from it; fuse::surface_mesh needs no
/// CAD. Same bytes for any number of threads. Cost: a sparse factorisation of the vertices that were not measured.
/// Errors: not_possible if nothing was measured; cancelled.
[[nodiscard]] Result<ClosedMesh> closed_mesh(const model::PreparedModel& model, const SpotFinder& finder,
                                             const ClosedMeshOptions& options, const Context& context);

}  // namespace asbuilt::inspect
