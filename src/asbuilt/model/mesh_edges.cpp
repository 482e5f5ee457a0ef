// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/mesh_edges.h"

#include <algorithm>
#include <tuple>

namespace asbuilt::model {

std::vector<EdgeSide> sorted_sides(const TriangleMesh& mesh) {
  std::vector<EdgeSide> sides;
  sides.reserve(3 * mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int corner = 0; corner < 3; ++corner) {
      const auto p = static_cast<std::uint32_t>(mesh.triangles[i][corner]);
      const auto q = static_cast<std::uint32_t>(mesh.triangles[i][(corner + 1) % 3]);
      sides.push_back({std::min(p, q), std::max(p, q), i, static_cast<std::uint32_t>(corner), p < q});
    }
  }
  std::ranges::sort(sides, {}, [](const EdgeSide& s) { return std::tuple(s.low, s.high, s.triangle, s.corner); });
  return sides;
}

std::size_t count_open_edges(const TriangleMesh& mesh) {
  std::size_t count = 0;
  for_each_edge(sorted_sides(mesh), [&](std::span<const EdgeSide> faces) { count += faces.size() == 1 ? 1 : 0; });
  return count;
}

}  // namespace asbuilt::model
