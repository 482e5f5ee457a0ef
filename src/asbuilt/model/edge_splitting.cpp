// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/edge_splitting.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace asbuilt::model {
namespace {

using Edge = std::pair<int, int>;

Edge edge_of(const Eigen::Vector3i& triangle, int side) {
  return std::minmax(triangle[side], triangle[(side + 1) % 3]);
}

// The pieces of a triangle whose side k has the midpoint middle[k], or -1.
std::vector<Eigen::Vector3i> pieces_of(Eigen::Vector3i t, std::array<int, 3> middle) {
  const auto halved = std::ranges::count_if(middle, [](int m) { return m >= 0; });
  const auto turn = [&] {
    t = Eigen::Vector3i(t[1], t[2], t[0]);
    std::ranges::rotate(middle, middle.begin() + 1);
  };
  switch (halved) {
    case 0:
      return {t};
    case 1:
      while (middle[0] < 0) turn();
      return {{t[0], middle[0], t[2]}, {middle[0], t[1], t[2]}};
    case 2:
      while (middle[2] >= 0) turn();
      return {{middle[0], t[1], middle[1]}, {t[0], middle[0], middle[1]}, {t[0], middle[1], t[2]}};
    default:
      return {{t[0], middle[0], middle[2]},
              {middle[0], t[1], middle[1]},
              {middle[2], middle[1], t[2]},
              {middle[0], middle[1], middle[2]}};
  }
}

}  // namespace

SplitMesh split_long_edges(const TriangleMesh& mesh, const std::vector<std::uint8_t>& chosen, double longest_mm) {
  SplitMesh result;
  result.mesh.vertices = mesh.vertices;
  std::map<Edge, int> midpoints;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (chosen[i] == 0) continue;
    for (int side = 0; side < 3; ++side) {
      const Edge edge = edge_of(mesh.triangles[i], side);
      const Eigen::Vector3d& a = mesh.vertices[static_cast<std::size_t>(edge.first)];
      const Eigen::Vector3d& b = mesh.vertices[static_cast<std::size_t>(edge.second)];
      if ((b - a).norm() <= longest_mm) continue;
      if (!midpoints.try_emplace(edge, static_cast<int>(result.mesh.vertices.size())).second) continue;
      result.mesh.vertices.emplace_back(0.5 * (a + b));
    }
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    std::array<int, 3> middle{-1, -1, -1};
    for (int side = 0; side < 3; ++side) {
      const auto found = midpoints.find(edge_of(mesh.triangles[i], side));
      if (found != midpoints.end()) middle[static_cast<std::size_t>(side)] = found->second;
    }
    for (const Eigen::Vector3i& piece : pieces_of(mesh.triangles[i], middle)) {
      result.mesh.triangles.push_back(piece);
      result.parents.push_back(static_cast<std::uint32_t>(i));
      if (!mesh.cad_faces.empty()) result.mesh.cad_faces.push_back(mesh.cad_faces[i]);
    }
  }
  return result;
}

}  // namespace asbuilt::model
