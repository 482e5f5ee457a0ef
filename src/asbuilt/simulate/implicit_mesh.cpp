// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/implicit_mesh.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstddef>
#include <unordered_map>
#include <utility>
#include <vector>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/matrix_factors.h"

namespace asbuilt::simulate {
namespace {

Eigen::Array3i unit(int axis) { return Eigen::Vector3i::Unit(axis).array(); }

// Values of the solid at the nodes of a grid.
class SampledSolid {
 public:
  SampledSolid(const Solid& solid, const Eigen::AlignedBox3d& box, double cell_mm)
      : solid_(solid), low_(box.min()), cell_mm_(cell_mm) {
    nodes_ = ((box.max() - box.min()) / cell_mm).array().ceil().cast<int>() + 1;
    values_.resize(static_cast<std::size_t>(nodes_.prod()));
    for (int z = 0; z < nodes_.z(); ++z) {
      for (int y = 0; y < nodes_.y(); ++y) {
        for (int x = 0; x < nodes_.x(); ++x) values_[index({x, y, z})] = solid(position({x, y, z}));
      }
    }
  }

  [[nodiscard]] const Eigen::Array3i& nodes() const { return nodes_; }
  [[nodiscard]] std::size_t index(const Eigen::Array3i& node) const {
    return static_cast<std::size_t>((node.z() * nodes_.y() + node.y()) * nodes_.x() + node.x());
  }
  [[nodiscard]] Eigen::Vector3d position(const Eigen::Array3i& node) const {
    return low_ + cell_mm_ * node.cast<double>().matrix();
  }
  [[nodiscard]] bool is_inside(const Eigen::Array3i& node) const { return values_[index(node)] < 0.0; }

  // Where the surface crosses the grid's edge from `node` along `axis`, and how it lies there.
  struct Crossing {
    Eigen::Vector3d point, normal;
  };
  const Crossing& crossing(const Eigen::Array3i& node, int axis) {
    const auto [place, is_new] = crossings_.try_emplace(3 * index(node) + static_cast<std::size_t>(axis));
    if (is_new) place->second = found_crossing(node, node + unit(axis));
    return place->second;
  }

  [[nodiscard]] double value(const Eigen::Vector3d& point) const { return solid_(point); }

 private:
  [[nodiscard]] Crossing found_crossing(const Eigen::Array3i& from, const Eigen::Array3i& to) const {
    Eigen::Vector3d inside = position(is_inside(from) ? from : to), outside = position(is_inside(from) ? to : from);
    for (int step = 0; step < 14; ++step) {
      const Eigen::Vector3d middle = 0.5 * (inside + outside);
      (solid_(middle) < 0.0 ? inside : outside) = middle;
    }
    const Eigen::Vector3d point = 0.5 * (inside + outside);
    return {point, normal(point)};
  }

  [[nodiscard]] Eigen::Vector3d normal(const Eigen::Vector3d& point) const {
    const double step = 1e-3 * cell_mm_;
    Eigen::Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d offset = step * Eigen::Vector3d::Unit(axis);
      gradient[axis] = solid_(point + offset) - solid_(point - offset);
    }
    return gradient.normalized();
  }

  const Solid& solid_;
  Eigen::Vector3d low_;
  double cell_mm_;
  Eigen::Array3i nodes_;
  std::vector<double> values_;
  std::unordered_map<std::size_t, Crossing> crossings_;  // looked up only, so its order never shows
};

// The point nearest to all tangent planes; directions that the planes leave open stay at the mean of the crossings.
Eigen::Vector3d sharp_point(const std::vector<Eigen::Vector3d>& points, const std::vector<Eigen::Vector3d>& normals) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) mean += point / static_cast<double>(points.size());
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    normal_matrix += normals[i] * normals[i].transpose();
    right_side += normals[i] * normals[i].dot(points[i] - mean);
  }
  const SymmetricEigen<3> eigen(normal_matrix);
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (eigen.eigenvalues()[k] < 0.05 * eigen.eigenvalues()[2]) continue;
    offset += eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).dot(right_side) / eigen.eigenvalues()[k];
  }
  return mean + offset;
}

// The edges of a cell are numbered 4 * axis + side, the sides by the two bits of their offset along the next two axes.
constexpr int kCellEdges = 12;

Eigen::Array3i start_of_edge(const Eigen::Array3i& cell, int edge) {
  const int axis = edge / 4, side = edge % 4;
  return cell + (side & 1) * unit((axis + 1) % 3) + (side >> 1) * unit((axis + 2) % 3);
}

// Which crossed edges of a cell belong to one patch of the surface. Patches are followed from face to face of the cell;
// where a face is crossed four times, the two edges at each inside corner go together. Both cells at that face decide
// alike, so a patch of one meets a patch of the other along one edge of the mesh.
DisjointSets patches_of_cell(const SampledSolid& grid, const Eigen::Array3i& cell) {
  DisjointSets patches(kCellEdges);
  for (int axis = 0; axis < 3; ++axis) {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (int level = 0; level < 2; ++level) {
      const auto corner_is_inside = [&](int i, int j) {
        return grid.is_inside(cell + level * unit(axis) + i * unit(a) + j * unit(b));
      };
      const int inside =
          corner_is_inside(0, 0) + corner_is_inside(1, 0) + corner_is_inside(0, 1) + corner_is_inside(1, 1);
      const bool crossed_four_times = inside == 2 && corner_is_inside(0, 0) == corner_is_inside(1, 1);
      int last = -1;
      for (const auto& [i, j] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
        const int along_a = 4 * a + (j | level << 1), along_b = 4 * b + (level | i << 1);
        const bool a_crossed = corner_is_inside(0, j) != corner_is_inside(1, j);
        const bool b_crossed = corner_is_inside(i, 0) != corner_is_inside(i, 1);
        if (crossed_four_times && corner_is_inside(i, j)) patches.unite(along_a, along_b);
        if (crossed_four_times) continue;
        for (const auto& [crossed, edge] : {std::pair{a_crossed, along_a}, {b_crossed, along_b}}) {
          if (!crossed) continue;
          if (last >= 0) patches.unite(last, edge);
          last = edge;
        }
      }
    }
  }
  return patches;
}

// The vertex of each crossed edge of each cell, by 12 * cell + edge: one for each patch of the surface in the cell.
using CellVertices = std::unordered_map<std::size_t, int>;  // looked up only

void place_in_cell(SampledSolid& grid, const Eigen::Array3i& cell, TriangleMesh& mesh, CellVertices& vertices) {
  std::array<std::vector<Eigen::Vector3d>, kCellEdges> points, normals;
  std::array<int, kCellEdges> patch_of_edge{};
  DisjointSets patches = patches_of_cell(grid, cell);
  for (int edge = 0; edge < kCellEdges; ++edge) {
    const auto index = static_cast<std::size_t>(edge);
    const Eigen::Array3i from = start_of_edge(cell, edge);
    patch_of_edge[index] = -1;
    if (grid.is_inside(from) == grid.is_inside(from + unit(edge / 4))) continue;
    patch_of_edge[index] = patches.find(edge);
    const SampledSolid::Crossing& crossing = grid.crossing(from, edge / 4);
    points[static_cast<std::size_t>(patch_of_edge[index])].push_back(crossing.point);
    normals[static_cast<std::size_t>(patch_of_edge[index])].push_back(crossing.normal);
  }
  const Eigen::Vector3d low = grid.position(cell), high = grid.position(cell + 1);
  for (std::size_t patch = 0; patch < kCellEdges; ++patch) {
    if (points[patch].empty()) continue;
    for (std::size_t edge = 0; edge < kCellEdges; ++edge) {
      if (patch_of_edge[edge] != static_cast<int>(patch)) continue;
      vertices[kCellEdges * grid.index(cell) + edge] = static_cast<int>(mesh.vertices.size());
    }
    mesh.vertices.push_back(sharp_point(points[patch], normals[patch]).cwiseMax(low).cwiseMin(high));
  }
}

bool is_crossed(const SampledSolid& grid, const Eigen::Array3i& cell) {
  int inside = 0;
  for (int corner = 0; corner < 8; ++corner) {
    inside += grid.is_inside(cell + Eigen::Array3i(corner & 1, corner >> 1 & 1, corner >> 2));
  }
  return inside != 0 && inside != 8;
}

CellVertices place_vertices(SampledSolid& grid, TriangleMesh& mesh) {
  const Eigen::Array3i nodes = grid.nodes();
  CellVertices vertices;
  for (int z = 0; z + 1 < nodes.z(); ++z) {
    for (int y = 0; y + 1 < nodes.y(); ++y) {
      for (int x = 0; x + 1 < nodes.x(); ++x) {
        if (is_crossed(grid, {x, y, z})) place_in_cell(grid, {x, y, z}, mesh, vertices);
      }
    }
  }
  return vertices;
}

// Two triangles for a quad, cut along the diagonal that lies nearer to the surface: the one along a sharp edge.
void add_quad(const std::array<int, 4>& quad, const SampledSolid& grid, TriangleMesh& mesh) {
  const auto off_surface = [&](std::size_t a, std::size_t b) {
    const auto at = [&](std::size_t k) { return mesh.vertices[static_cast<std::size_t>(quad[k])]; };
    return std::abs(grid.value(0.5 * (at(a) + at(b))));
  };
  if (off_surface(0, 2) <= off_surface(1, 3)) {
    mesh.triangles.insert(mesh.triangles.end(), {{quad[0], quad[1], quad[2]}, {quad[0], quad[2], quad[3]}});
  } else {
    mesh.triangles.insert(mesh.triangles.end(), {{quad[0], quad[1], quad[3]}, {quad[1], quad[2], quad[3]}});
  }
}

}  // namespace

TriangleMesh surface_of(const Solid& solid, const Eigen::AlignedBox3d& box, double cell_mm) {
  const Eigen::AlignedBox3d padded(box.min().array() - 1.5 * cell_mm, box.max().array() + 1.5 * cell_mm);
  SampledSolid grid(solid, padded, cell_mm);
  TriangleMesh mesh;
  const CellVertices vertices = place_vertices(grid, mesh);
  const Eigen::Array3i nodes = grid.nodes();
  for (int z = 1; z + 1 < nodes.z(); ++z) {
    for (int y = 1; y + 1 < nodes.y(); ++y) {
      for (int x = 1; x + 1 < nodes.x(); ++x) {
        const Eigen::Array3i node(x, y, z);
        for (int axis = 0; axis < 3; ++axis) {
          const Eigen::Array3i next = node + unit(axis);
          if (grid.is_inside(node) == grid.is_inside(next)) continue;
          const Eigen::Array3i u = unit((axis + 1) % 3), v = unit((axis + 2) % 3);
          const auto vertex = [&](const Eigen::Array3i& cell, int side) {
            return vertices.at(kCellEdges * grid.index(cell) + static_cast<std::size_t>(4 * axis + side));
          };
          std::array<int, 4> quad{vertex(node - u - v, 3), vertex(node - v, 2), vertex(node, 0), vertex(node - u, 1)};
          if (!grid.is_inside(node)) std::swap(quad[1], quad[3]);
          add_quad(quad, grid, mesh);
        }
      }
    }
  }
  return mesh;
}

}  // namespace asbuilt::simulate
