// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/mesh_clean.h"

#include <algorithm>
#include <array>
#include <compare>
#include <cstddef>
#include <utility>
#include <vector>

#include "asbuilt/core/disjoint_sets.h"

namespace asbuilt::fuse {
namespace {

struct EdgeUse {
  int low = 0, high = 0;
  bool is_upward = false;  // the triangle goes from low to high
  int triangle = 0;

  [[nodiscard]] bool is_same_edge(const EdgeUse& other) const { return low == other.low && high == other.high; }
  auto operator<=>(const EdgeUse&) const = default;
};

std::vector<EdgeUse> edge_uses(const TriangleMesh& mesh) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int from = mesh.triangles[t][k], to = mesh.triangles[t][(k + 1) % 3];
      uses.push_back({std::min(from, to), std::max(from, to), from < to, static_cast<int>(t)});
    }
  }
  std::ranges::sort(uses);
  return uses;
}

// Calls visit(first, last) with each edge's range of uses.
template <class Visit>
void for_each_edge(const std::vector<EdgeUse>& uses, const Visit& visit) {
  for (auto first = uses.begin(); first != uses.end();) {
    const auto last = std::find_if(first, uses.end(), [&](const EdgeUse& use) { return !use.is_same_edge(*first); });
    visit(first, last);
    first = last;
  }
}

// Cuts a triangle in two from `middle`, a point on its edge between `low` and `high`.
void split_at(TriangleMesh& mesh, const EdgeUse& use, int middle) {
  Eigen::Vector3i& first = mesh.triangles[static_cast<std::size_t>(use.triangle)];
  Eigen::Vector3i second = first;
  for (int k = 0; k < 3; ++k) {
    if (first[k] == use.low) second[k] = middle;
    if (first[k] == use.high) first[k] = middle;
  }
  mesh.triangles.push_back(second);
}

// Splits the shared edges of one sweep; an edge waits if one of its triangles has been split already.
bool separate_some(TriangleMesh& mesh) {
  const std::vector<EdgeUse> uses = edge_uses(mesh);
  std::vector<char> is_split(mesh.triangles.size(), 0);
  bool found = false;
  for_each_edge(uses, [&](auto first, auto last) {
    if (last - first <= 2) return;
    found = true;
    if (std::any_of(first, last,
                    [&](const EdgeUse& use) { return is_split[static_cast<std::size_t>(use.triangle)]; })) {
      return;
    }
    // Downward uses come first. The k-th of each direction make a pair.
    const auto upward = std::find_if(first, last, [](const EdgeUse& use) { return use.is_upward; });
    const Eigen::Vector3d middle = 0.5 * (mesh.vertices[static_cast<std::size_t>(first->low)] +
                                          mesh.vertices[static_cast<std::size_t>(first->high)]);
    for (auto pair = 0; pair < std::max(upward - first, last - upward); ++pair) {
      const int vertex = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(middle);
      if (pair < upward - first) split_at(mesh, *(first + pair), vertex);
      if (pair < last - upward) split_at(mesh, *(upward + pair), vertex);
    }
    std::for_each(first, last, [&](const EdgeUse& use) { is_split[static_cast<std::size_t>(use.triangle)] = 1; });
  });
  return found;
}

void drop_triangles_beyond_two(TriangleMesh& mesh) {
  std::vector<char> is_dropped(mesh.triangles.size(), 0);
  for_each_edge(edge_uses(mesh), [&](auto first, auto last) {
    for (auto use = first; use != last; ++use) {
      if (use - first >= 2) is_dropped[static_cast<std::size_t>(use->triangle)] = 1;
    }
  });
  std::size_t t = 0;
  std::erase_if(mesh.triangles, [&](const Eigen::Vector3i&) { return is_dropped[t++] != 0; });
}

}  // namespace

void separate_shared_edges(TriangleMesh& mesh) {
  constexpr int kMostSweeps = 8;  // each edge takes one; more only where a triangle has several of them
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    if (!separate_some(mesh)) return;
  }
  drop_triangles_beyond_two(mesh);
}

TriangleMesh without_small_pieces(const TriangleMesh& mesh, int fewest) {
  DisjointSets pieces(static_cast<int>(mesh.triangles.size()));
  for_each_edge(edge_uses(mesh), [&](auto first, auto last) {
    for (auto use = first; use != last; ++use) pieces.unite(first->triangle, use->triangle);
  });
  std::vector<int> size(mesh.triangles.size(), 0);
  for (int t = 0; t < pieces.size(); ++t) ++size[static_cast<std::size_t>(pieces.find(t))];

  TriangleMesh kept;
  std::vector<int> place(mesh.vertices.size(), -1);
  for (int t = 0; t < pieces.size(); ++t) {
    if (size[static_cast<std::size_t>(pieces.find(t))] < fewest) continue;
    Eigen::Vector3i triangle = mesh.triangles[static_cast<std::size_t>(t)];
    for (int& vertex : triangle) {
      const auto v = static_cast<std::size_t>(vertex);
      if (place[v] < 0) {
        place[v] = static_cast<int>(kept.vertices.size());
        kept.vertices.push_back(mesh.vertices[v]);
      }
      vertex = place[v];
    }
    kept.triangles.push_back(triangle);
  }
  return kept;
}

}  // namespace asbuilt::fuse
