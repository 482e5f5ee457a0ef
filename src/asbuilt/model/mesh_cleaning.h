// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::model {

struct CleanedMesh {
  TriangleMesh mesh;  ///< vertices in order of first use, triangles in the order they came
  std::size_t vertices_welded = 0, degenerate_dropped = 0, duplicates_dropped = 0;
};

/// Makes one of the vertices closer than `tolerance_mm`, then drops triangles that are lower than it and triangles
/// that have the same corners as an earlier one, in whatever order. Needs finite vertices. Cost O(n log n).
[[nodiscard]] CleanedMesh cleaned(const TriangleMesh& mesh, double tolerance_mm);

/// The triangles whose entry in `keep` is not 0, with the vertices they use.
[[nodiscard]] TriangleMesh subset(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep);

}  // namespace asbuilt::model
