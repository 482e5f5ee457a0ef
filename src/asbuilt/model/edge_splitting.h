// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::model {

struct SplitMesh {
  TriangleMesh mesh;
  std::vector<std::uint32_t> parents;  ///< per triangle the one of the mesh before that it is a piece of
};

/// Halves those edges of the chosen triangles that are longer than `longest_mm`, for every triangle that shares them:
/// what hung together over edges still does. Pieces come in the order of the triangles, with their winding.
[[nodiscard]] SplitMesh split_long_edges(const TriangleMesh& mesh, const std::vector<std::uint8_t>& chosen,
                                         double longest_mm);

}  // namespace asbuilt::model
