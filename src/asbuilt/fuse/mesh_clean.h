// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::fuse {

/// Makes every edge belong to at most two triangles. Where two sheets share an edge (a tunnel narrower than a cell of
/// the grid), each sheet gets a middle point of its own there; nothing moves.
void separate_shared_edges(TriangleMesh& mesh);

/// Leaves out pieces, connected over common edges, of fewer triangles than `fewest`, and vertices that no triangle
/// uses.
[[nodiscard]] TriangleMesh without_small_pieces(const TriangleMesh& mesh, int fewest);

}  // namespace asbuilt::fuse
