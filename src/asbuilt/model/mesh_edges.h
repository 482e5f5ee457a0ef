// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::model {

/// One side of one triangle, as an undirected edge between two vertices.
struct EdgeSide {
  std::uint32_t low, high;  ///< vertices, low < high
  std::uint32_t triangle;
  std::uint32_t corner;  ///< the side runs from this corner of the triangle to the next
  bool ascending;        ///< whether the triangle runs it from low to high
};

/// All sides, sorted by (low, high, triangle, corner): the faces at an edge stand side by side.
[[nodiscard]] std::vector<EdgeSide> sorted_sides(const TriangleMesh& mesh);

/// Calls visit(faces) for each edge in order; `faces` are its sides, at least one.
template <class Visit>
void for_each_edge(const std::vector<EdgeSide>& sides, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    while (end < sides.size() && sides[end].low == sides[begin].low && sides[end].high == sides[begin].high) ++end;
    visit(std::span(sides).subspan(begin, end - begin));
  }
}

/// Edges with one face only.
[[nodiscard]] std::size_t count_open_edges(const TriangleMesh& mesh);

}  // namespace asbuilt::model
