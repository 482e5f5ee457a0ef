// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <unordered_map>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/model/mesh_edges.h"

namespace asbuilt::model {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

std::vector<Eigen::Vector3d> unit_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> normals(mesh.triangles.size());
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = doubled_area_vector(mesh, i).stableNormalized();
  return normals;
}

double angle_at(const TriangleMesh& mesh, const Eigen::Vector3i& triangle, int corner) {
  const auto vertex = [&](int k) { return mesh.vertices[static_cast<std::size_t>(triangle[(corner + k) % 3])]; };
  const Eigen::Vector3d u = vertex(1) - vertex(0), v = vertex(2) - vertex(0);
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// The corners of all triangles (3 * triangle + corner) that meet in one vertex of the result: those that can be
/// reached from one another around a vertex without crossing a sharp or open edge.
DisjointSets joined_corners(const TriangleMesh& mesh, const std::vector<Eigen::Vector3d>& normals, double sharp_deg) {
  const double cosine = std::cos(sharp_deg * std::numbers::pi / 180.0);
  DisjointSets corners(static_cast<int>(3 * mesh.triangles.size()));
  for_each_edge(sorted_sides(mesh), [&](std::span<const EdgeSide> faces) {
    if (faces.size() != 2 || faces[0].ascending == faces[1].ascending) return;
    if (normals[faces[0].triangle].dot(normals[faces[1].triangle]) < cosine) return;
    const auto from = [](const EdgeSide& side) { return static_cast<int>(3 * side.triangle + side.corner); };
    const auto to = [](const EdgeSide& side) { return static_cast<int>(3 * side.triangle + (side.corner + 1) % 3); };
    corners.unite(from(faces[0]), to(faces[1]));  // they run the edge in opposite ways
    corners.unite(to(faces[0]), from(faces[1]));
  });
  return corners;
}

SurfaceMesh split_at_sharp_edges(const TriangleMesh& mesh, double sharp_deg) {
  const std::vector<Eigen::Vector3d> face_normals = unit_normals(mesh);
  DisjointSets corners = joined_corners(mesh, face_normals, sharp_deg);
  constexpr std::uint32_t kNew = 0xffffffffU;
  std::vector<std::uint32_t> vertex_of_root(3 * mesh.triangles.size(), kNew);
  std::vector<Eigen::Vector3d> normals;
  SurfaceMesh result;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    Triangle triangle{};
    for (int corner = 0; corner < 3; ++corner) {
      const auto root = static_cast<std::size_t>(corners.find(static_cast<int>(3 * i) + corner));
      if (vertex_of_root[root] == kNew) {
        vertex_of_root[root] = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][corner])]);
        normals.emplace_back(Eigen::Vector3d::Zero());
      }
      triangle[static_cast<std::size_t>(corner)] = vertex_of_root[root];
      normals[vertex_of_root[root]] += angle_at(mesh, mesh.triangles[i], corner) * face_normals[i];
    }
    result.triangles.push_back(triangle);
    result.skin_triangles.push_back(i);
    if (!mesh.cad_faces.empty()) result.faces.push_back(static_cast<std::uint32_t>(mesh.cad_faces[i]));
  }
  for (const Eigen::Vector3d& normal : normals) {
    const Eigen::Vector3d direction = normal.norm() > 1e-12 ? normal.normalized() : Eigen::Vector3d::UnitZ();
    result.normals.emplace_back(direction.cast<float>());
  }
  return result;
}

/// Splits every edge that is longer than a length in its middle, once.
class Splitter {
 public:
  Splitter(SurfaceMesh& mesh, double length_mm) : mesh_(mesh), squared_length_(length_mm * length_mm) {}

  /// False when no edge was too long.
  bool run() {
    SurfaceMesh before;
    before.triangles.swap(mesh_.triangles);
    before.skin_triangles.swap(mesh_.skin_triangles);
    before.faces.swap(mesh_.faces);
    for (std::size_t i = 0; i < before.triangles.size(); ++i) {
      const std::size_t begin = mesh_.triangles.size();
      split(before.triangles[i]);
      const std::size_t pieces = mesh_.triangles.size() - begin;
      mesh_.skin_triangles.insert(mesh_.skin_triangles.end(), pieces, before.skin_triangles[i]);
      if (!before.faces.empty()) mesh_.faces.insert(mesh_.faces.end(), pieces, before.faces[i]);
    }
    return !middles_.empty();
  }

 private:
  static constexpr std::uint32_t kWhole = 0xffffffffU;

  void add(std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh_.triangles.push_back({a, b, c}); }

  /// The vertex in the middle of an edge that is too long. Whether it is depends on the two places alone, so that both
  /// sides of a sharp edge, which share no vertices, agree.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    if (!((mesh_.vertices[b] - mesh_.vertices[a]).squaredNorm() > squared_length_)) return kWhole;
    const std::uint64_t key = (static_cast<std::uint64_t>(a) << 32) | b;
    const auto [place, is_new] = middles_.try_emplace(key, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (is_new) {
      mesh_.vertices.emplace_back(0.5 * (mesh_.vertices[a] + mesh_.vertices[b]));
      const Eigen::Vector3f sum = mesh_.normals[a] + mesh_.normals[b];
      mesh_.normals.push_back(sum.norm() > 1e-6F ? sum.normalized() : mesh_.normals[a]);
    }
    return place->second;
  }

  void split(const Triangle& t) {
    const std::array<std::uint32_t, 3> m{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    const auto count = std::ranges::count_if(m, [](std::uint32_t vertex) { return vertex != kWhole; });
    if (count == 0) return add(t[0], t[1], t[2]);
    if (count == 3) {
      add(t[0], m[0], m[2]);
      add(m[0], t[1], m[1]);
      add(m[2], m[1], t[2]);
      return add(m[0], m[1], m[2]);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
      if (count == 1 && m[k] != kWhole) {
        add(t[k], m[k], t[last]);
        return add(m[k], t[next], t[last]);
      }
      if (count == 2 && m[k] == kWhole) return split_two(t[k], t[next], t[last], m[next], m[last]);
    }
  }

  /// Edge ab is whole, bc has the middle m, ca the middle n; what is left of the corner is cut along its shorter
  /// diagonal.
  void split_two(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t m, std::uint32_t n) {
    add(n, m, c);
    const double am = (mesh_.vertices[m] - mesh_.vertices[a]).squaredNorm();
    const double bn = (mesh_.vertices[n] - mesh_.vertices[b]).squaredNorm();
    if (am <= bn) {
      add(a, b, m);
      add(a, m, n);
    } else {
      add(a, b, n);
      add(b, m, n);
    }
  }

  SurfaceMesh& mesh_;
  double squared_length_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;  // looked up only, never walked through
};

/// Merges the vertices of each cube of `size_mm` that face the same octant; what collapses is left out.
TriangleMesh thinned(const TriangleMesh& mesh, double size_mm) {
  const std::vector<Eigen::Vector3d> normals = unit_normals(mesh);
  std::vector<Eigen::Vector3d> vertex_normals(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) vertex_normals[static_cast<std::size_t>(mesh.triangles[i][k])] += normals[i];
  }
  const VoxelGrid grid{bounding_box(mesh).min(), size_mm};
  std::map<std::pair<VoxelKey, int>, int> cells;
  std::vector<int> cell_of(mesh.vertices.size());
  std::vector<std::pair<Eigen::Vector3d, int>> sums;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3d& n = vertex_normals[i];
    const int octant = (n.x() < 0.0 ? 1 : 0) + (n.y() < 0.0 ? 2 : 0) + (n.z() < 0.0 ? 4 : 0);
    const auto [cell, is_new] = cells.try_emplace({grid.key(mesh.vertices[i]), octant}, static_cast<int>(sums.size()));
    if (is_new) sums.emplace_back(Eigen::Vector3d::Zero(), 0);
    cell_of[i] = cell->second;
    sums[static_cast<std::size_t>(cell->second)].first += mesh.vertices[i];
    ++sums[static_cast<std::size_t>(cell->second)].second;
  }
  TriangleMesh result;
  for (const auto& [sum, count] : sums) result.vertices.emplace_back(sum / count);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3i& t = mesh.triangles[i];
    const auto cell = [&](int k) { return cell_of[static_cast<std::size_t>(t[k])]; };
    if (cell(0) == cell(1) || cell(1) == cell(2) || cell(2) == cell(0)) continue;
    result.triangles.emplace_back(cell(0), cell(1), cell(2));
    if (!mesh.cad_faces.empty()) result.cad_faces.push_back(mesh.cad_faces[i]);
  }
  return result;
}

/// The mesh split down to a length, or nothing if that takes too many triangles.
bool split_down(SurfaceMesh& mesh, double length_mm, std::size_t max_triangles) {
  for (bool again = true; again;) {
    again = Splitter(mesh, length_mm).run();
    if (mesh.triangles.size() > max_triangles) return false;
  }
  return true;
}

}  // namespace

SurfaceMesh surface_mesh(const TriangleMesh& skin, const SurfaceMeshOptions& options) {
  constexpr double kStep = 1.19;  // fourth root of 2: the count falls by about a third a step
  if (skin.triangles.size() > options.max_triangles) {
    double size_mm = diameter(skin) / 600.0;
    TriangleMesh coarse = thinned(skin, size_mm);
    while (coarse.triangles.size() > options.max_triangles) coarse = thinned(skin, size_mm *= kStep);
    SurfaceMesh result = split_at_sharp_edges(coarse, options.sharp_angle_deg);
    // The pieces' places in the skin went with the vertices.
    result.skin_triangles.clear();
    return result;
  }
  const SurfaceMesh whole = split_at_sharp_edges(skin, options.sharp_angle_deg);
  if (!(options.edge_length_mm > 0.0)) return whole;
  for (double length_mm = options.edge_length_mm;; length_mm *= kStep) {
    SurfaceMesh mesh = whole;
    if (split_down(mesh, length_mm, options.max_triangles)) return mesh;
  }
}

}  // namespace asbuilt::model
