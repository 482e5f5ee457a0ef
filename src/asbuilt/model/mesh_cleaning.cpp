// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/mesh_cleaning.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <vector>

#include "asbuilt/core/disjoint_sets.h"

namespace asbuilt::model {
namespace {

using Cell = std::array<std::int64_t, 3>;

// Vertices by grid cell. Cells are four tolerances wide, so that the box around a vertex mostly stays in its own.
class CellIndex {
 public:
  CellIndex(const std::vector<Eigen::Vector3d>& vertices, const Eigen::Vector3d& origin, double tolerance)
      : origin_(origin), width_(4.0 * tolerance) {
    for (std::size_t i = 0; i < vertices.size(); ++i) entries_.push_back({cell(vertices[i]), static_cast<int>(i)});
    std::ranges::sort(entries_, {}, [](const Entry& e) { return std::tie(e.cell, e.vertex); });
  }

  template <class Visit>
  void for_each_near(const Eigen::Vector3d& point, double tolerance, const Visit& visit) const {
    const Cell low = cell(point.array() - tolerance), high = cell(point.array() + tolerance);
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) {
          for (const Entry& entry : std::ranges::equal_range(entries_, Cell{x, y, z}, {}, &Entry::cell)) {
            visit(entry.vertex);
          }
        }
      }
    }
  }

 private:
  struct Entry {
    Cell cell;
    int vertex;
  };

  [[nodiscard]] Cell cell(const Eigen::Vector3d& point) const {
    Cell result;
    for (int axis = 0; axis < 3; ++axis) {
      result[static_cast<std::size_t>(axis)] =
          static_cast<std::int64_t>(std::floor((point[axis] - origin_[axis]) / width_));
    }
    return result;
  }

  Eigen::Vector3d origin_;
  double width_;
  std::vector<Entry> entries_;
};

// For each vertex the lowest index it is one with.
std::vector<int> welded_vertices(const TriangleMesh& mesh, double tolerance) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  const CellIndex index(mesh.vertices, box.isEmpty() ? Eigen::Vector3d::Zero() : box.min(), tolerance);
  DisjointSets sets(static_cast<int>(mesh.vertices.size()));
  for (int i = 0; i < sets.size(); ++i) {
    const Eigen::Vector3d& point = mesh.vertices[static_cast<std::size_t>(i)];
    index.for_each_near(point, tolerance, [&](int other) {
      if (other >= i) return;
      if ((mesh.vertices[static_cast<std::size_t>(other)] - point).norm() <= tolerance) sets.unite(other, i);
    });
  }
  std::vector<int> root(mesh.vertices.size());
  for (int i = 0; i < sets.size(); ++i) root[static_cast<std::size_t>(i)] = sets.find(i);
  return root;
}

bool is_degenerate(const TriangleMesh& mesh, const Eigen::Vector3i& t, double tolerance) {
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return true;
  const auto at = [&](int k) -> const Eigen::Vector3d& { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
  const double longest = std::max({(at(1) - at(0)).norm(), (at(2) - at(1)).norm(), (at(0) - at(2)).norm()});
  return !((at(1) - at(0)).cross(at(2) - at(0)).norm() > tolerance * longest);
}

std::vector<std::uint8_t> first_of_each(const std::vector<Eigen::Vector3i>& triangles) {
  std::vector<std::pair<std::array<int, 3>, std::size_t>> keys;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    std::array<int, 3> corners{triangles[i][0], triangles[i][1], triangles[i][2]};
    std::ranges::sort(corners);
    keys.emplace_back(corners, i);
  }
  std::ranges::sort(keys);
  std::vector<std::uint8_t> keep(triangles.size(), 1);
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].first == keys[i - 1].first) keep[keys[i].second] = 0;
  }
  return keep;
}

}  // namespace

TriangleMesh subset(const TriangleMesh& mesh, const std::vector<std::uint8_t>& keep) {
  TriangleMesh result;
  std::vector<int> place(mesh.vertices.size(), -1);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (keep[i] == 0) continue;
    Eigen::Vector3i corners;
    for (int k = 0; k < 3; ++k) {
      const auto vertex = static_cast<std::size_t>(mesh.triangles[i][k]);
      if (place[vertex] < 0) {
        place[vertex] = static_cast<int>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[vertex]);
      }
      corners[k] = place[vertex];
    }
    result.triangles.push_back(corners);
    if (!mesh.cad_faces.empty()) result.cad_faces.push_back(mesh.cad_faces[i]);
  }
  return result;
}

CleanedMesh cleaned(const TriangleMesh& mesh, double tolerance_mm) {
  const std::vector<int> root = welded_vertices(mesh, tolerance_mm);
  CleanedMesh result;
  for (std::size_t i = 0; i < root.size(); ++i) result.vertices_welded += root[i] != static_cast<int>(i) ? 1 : 0;

  TriangleMesh welded{mesh.vertices, {}};
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3i corners =
        mesh.triangles[i].unaryExpr([&](int vertex) { return root[static_cast<std::size_t>(vertex)]; });
    if (is_degenerate(welded, corners, tolerance_mm)) {
      ++result.degenerate_dropped;
    } else {
      welded.triangles.push_back(corners);
      if (!mesh.cad_faces.empty()) welded.cad_faces.push_back(mesh.cad_faces[i]);
    }
  }
  result.mesh = subset(welded, first_of_each(welded.triangles));
  result.duplicates_dropped = welded.triangles.size() - result.mesh.triangles.size();
  return result;
}

}  // namespace asbuilt::model
