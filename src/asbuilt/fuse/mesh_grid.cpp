// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/mesh_grid.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::fuse {
namespace {

constexpr int kSide = 8;  // nodes of a brick along each axis
constexpr int kNodes = kSide * kSide * kSide;
constexpr int kCellEdges = 12;
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

constexpr float kReachInWidths = 3.2F;   // nodes around a sample: foot within SurfaceField's reach, at most a slab high
constexpr float kSlabInCells = 2.0F;     // a cell's diagonal, and a little for curvature
constexpr float kBesideInWidths = 0.8F;  // a place this near to a sample is covered; any further it must have samples
constexpr int kFewestSamples = 5;        // a lattice has 15 within reach, half of them at a rim
constexpr float kAroundImbalance = 0.6F;  // ... on all sides: beyond a straight rim the imbalance is 0.64 and more
constexpr float kConvergedInCells = 0.02F;
constexpr float kOffSurfaceInCells = 0.25F;  // signs may change between two layers; no surface is there
constexpr double kEdgeShare = 0.1;  // of the largest eigenvalue: normals in a cell differ so that they make an edge

Eigen::Array3i unit(int axis) { return Eigen::Vector3i::Unit(axis).array(); }
int local_of(const Eigen::Array3i& node) { return (node.z() * kSide + node.y()) * kSide + node.x(); }
Eigen::Array3i node_of(int local) { return {local % kSide, local / kSide % kSide, local / (kSide * kSide)}; }

// Where the surface crosses the grid's edge that starts at a node, and how it lies there.
struct Crossing {
  int edge = 0;                 // 3 * local node + axis
  bool is_on_surface = false;   // and no further from the samples than the largest hole
  bool is_supported = false;    // and not beyond a rim of them
  std::uint32_t reference = 0;  // a sample near it
  Eigen::Vector3f point = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
};

// The vertex on each crossed edge of a cell: one for each piece of the surface in it. -1: not crossed, or no support.
struct CellVertices {
  int cell = 0;  // local node at its low corner
  std::array<int, kCellEdges> vertex{};
};

struct Brick {
  Eigen::Array3i low;                  // node coordinates of its first node
  std::vector<float> height;           // of each node; NaN where no sample is near
  std::vector<std::uint32_t> nearest;  // sample of each node
  std::vector<Crossing> crossings;     // by edge
  std::vector<CellVertices> cells;     // by cell; vertex numbers count from first_vertex
  std::vector<Eigen::Vector3d> vertices;
  int first_vertex = 0;
  std::array<int, 27> neighbours{};  // bricks around it, -1 where there is none
};

// The edges of a cell are numbered 4 * axis + side, the sides by the two bits of their offset along the next two axes.
Eigen::Array3i start_of_edge(const Eigen::Array3i& cell, int edge) {
  const int axis = edge / 4, side = edge % 4;
  return cell + (side & 1) * unit((axis + 1) % 3) + (side >> 1) * unit((axis + 2) % 3);
}

// Which crossed edges of a cell belong to one piece of the surface. Pieces are followed from face to face of the cell;
// where a face is crossed four times, the two edges at each inside corner go together. Both cells at that face decide
// alike, so that the pieces of one meet those of the other. `inside` has one bit a corner: x + 2 y + 4 z.
DisjointSets pieces_of_cell(unsigned inside) {
  const auto is_inside = [&](const Eigen::Array3i& corner) {
    return (inside >> (corner.x() + 2 * corner.y() + 4 * corner.z()) & 1U) != 0U;
  };
  DisjointSets pieces(kCellEdges);
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, level = face % 2, a = (axis + 1) % 3, b = (axis + 2) % 3;
    const auto corner = [&](int i, int j) { return is_inside(level * unit(axis) + i * unit(a) + j * unit(b)); };
    // Along a at j = 0 and 1, along b at i = 0 and 1; the sides as start_of_edge numbers them.
    const auto along_a = [&](int j) { return 4 * a + (j | level << 1); };
    const auto along_b = [&](int i) { return 4 * b + (level | i << 1); };
    const bool four_times =
        corner(0, 0) == corner(1, 1) && corner(0, 1) == corner(1, 0) && corner(0, 0) != corner(0, 1);
    if (four_times) {
      for (int i = 0; i < 2; ++i) pieces.unite(along_a(corner(i, 0) ? 0 : 1), along_b(i));
      continue;
    }
    int last = -1;
    const auto follow = [&](bool is_crossed, int edge) {
      if (!is_crossed) return;
      if (last >= 0) pieces.unite(last, edge);
      last = edge;
    };
    for (int k = 0; k < 2; ++k) {
      follow(corner(0, k) != corner(1, k), along_a(k));
      follow(corner(k, 0) != corner(k, 1), along_b(k));
    }
  }
  return pieces;
}

struct VertexPlace {
  Eigen::Vector3d point;
  bool is_on_edge = false;
};

// The point nearest to all tangent planes; directions that the planes leave open stay at the mean of the crossings.
VertexPlace nearest_to_planes(const std::vector<const Crossing*>& crossings) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Crossing* crossing : crossings) mean += crossing->point.cast<double>();
  mean /= static_cast<double>(crossings.size());
  Eigen::Matrix3d directions = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  for (const Crossing* crossing : crossings) {
    const Eigen::Vector3d normal = crossing->normal.cast<double>();
    directions += normal * normal.transpose();
    right_side += normal * normal.dot(crossing->point.cast<double>() - mean);
  }
  const SymmetricEigen<3> eigen(directions);
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (eigen.eigenvalues()[k] < kEdgeShare * eigen.eigenvalues()[2]) continue;
    offset += eigen.eigenvectors().col(k) * eigen.eigenvectors().col(k).dot(right_side) / eigen.eigenvalues()[k];
  }
  return {mean + offset, eigen.eigenvalues()[1] >= kEdgeShare * eigen.eigenvalues()[2]};
}

class SparseSurface {
 public:
  SparseSurface(const SurfaceField& field, const FieldSamples& samples, double cell_mm, double max_hole_widths,
                const Context& context)
      : field_(field),
        samples_(samples),
        cell_(cell_mm),
        max_hole_(static_cast<float>(max_hole_widths)),
        context_(context) {}

  TriangleMesh mesh() {
    make_bricks();
    for_each_brick(0.55, [&](Brick& brick) { take_heights(brick); });
    for_each_brick(0.65, [&](Brick& brick) { find_crossings(brick); });
    for_each_brick(0.9, [&](Brick& brick) { place_vertices(brick); });
    TriangleMesh mesh;
    for (Brick& brick : bricks_) {
      brick.first_vertex = static_cast<int>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), brick.vertices.begin(), brick.vertices.end());
    }
    std::vector<std::vector<Eigen::Vector3i>> triangles(bricks_.size());
    parallel_for(context_, bricks_.size(), 1, [&](std::size_t b) {
      if (!context_.cancelled()) triangles[b] = triangles_of(bricks_[b], mesh.vertices);
    });
    for (const auto& some : triangles) mesh.triangles.insert(mesh.triangles.end(), some.begin(), some.end());
    return mesh;
  }

 private:
  template <class Task>
  void for_each_brick(double progress, const Task& task) {
    parallel_for(context_, bricks_.size(), 1, [&](std::size_t b) {
      if (!context_.cancelled()) task(bricks_[b]);
    });
    context_.report_progress(progress);
  }

  [[nodiscard]] Eigen::Vector3f position(const Eigen::Array3i& node) const {
    return (origin_ + cell_ * node.cast<double>().matrix()).cast<float>();
  }

  // Pairs of brick and sample near it, sorted: the samples of each brick are one range.
  void make_bricks() {
    const std::vector<Eigen::Vector3f>& points = samples_.cloud.positions;
    Eigen::Vector3f low = points.front();
    for (const Eigen::Vector3f& point : points) low = low.cwiseMin(point);
    origin_ = low.cast<double>();
    const VoxelGrid bricks{origin_, kSide * cell_};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d reach = Eigen::Vector3d::Constant(kReachInWidths * samples_.width_mm[i]);
      const Eigen::Vector3i first = bricks.cell(points[i].cast<double>() - reach);
      const Eigen::Vector3i last = bricks.cell(points[i].cast<double>() + reach);
      for (int z = first.z(); z <= last.z(); ++z) {
        for (int y = first.y(); y <= last.y(); ++y) {
          for (int x = first.x(); x <= last.x(); ++x) {
            pairs_.push_back({VoxelGrid::key_of_cell({x, y, z}), static_cast<std::uint32_t>(i)});
          }
        }
      }
    }
    stable_parallel_sort(context_, pairs_, std::less<>{});
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      if (!keys_.empty() && keys_.back() == pairs_[i].first) continue;
      keys_.push_back(pairs_[i].first);
      starts_.push_back(i);
      bricks_.emplace_back();
      const Eigen::Vector3i brick = cell_of_key(keys_.back());
      bricks_.back().low = kSide * brick.array();
    }
    starts_.push_back(pairs_.size());
    for_each_brick(0.2, [&](Brick& brick) { find_neighbours(brick); });
  }

  static Eigen::Vector3i cell_of_key(VoxelKey key) {
    const auto part = [&](int shift) { return static_cast<int>(key >> shift & 0x1fffffU) - (1 << 20); };
    return {part(0), part(21), part(42)};
  }

  void find_neighbours(Brick& brick) const {
    for (int k = 0; k < 27; ++k) {
      const Eigen::Vector3i offset(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
      const VoxelKey key = VoxelGrid::key_of_cell((brick.low / kSide).matrix() + offset);
      const auto at = std::ranges::lower_bound(keys_, key);
      const bool is_there = at != keys_.end() && *at == key;
      brick.neighbours[static_cast<std::size_t>(k)] = is_there ? static_cast<int>(at - keys_.begin()) : -1;
    }
  }

  // The brick that holds a node up to one brick away, and the node's place in it; {nullptr, 0} if there is none.
  [[nodiscard]] std::pair<const Brick*, int> located(const Brick& brick, const Eigen::Array3i& node) const {
    const Eigen::Array3i shifted = node + kSide, offset = shifted / kSide;
    const int neighbour = brick.neighbours[static_cast<std::size_t>(offset.x() + 3 * offset.y() + 9 * offset.z())];
    if (neighbour < 0) return {nullptr, 0};
    return {&bricks_[static_cast<std::size_t>(neighbour)], local_of(shifted - kSide * offset)};
  }

  [[nodiscard]] float height_at(const Brick& brick, const Eigen::Array3i& node) const {
    const auto [holder, local] = located(brick, node);
    return holder ? holder->height[static_cast<std::size_t>(local)] : std::numeric_limits<float>::quiet_NaN();
  }

  void take_heights(Brick& brick) const {
    const auto number = static_cast<std::size_t>(&brick - bricks_.data());
    std::vector<float> squared(kNodes, std::numeric_limits<float>::infinity());
    std::vector<char> is_wanted(kNodes, 0);
    brick.nearest.assign(kNodes, kNone);
    brick.height.assign(kNodes, std::numeric_limits<float>::quiet_NaN());
    for (std::size_t i = starts_[number]; i < starts_[number + 1]; ++i) {
      mark_nodes(brick, pairs_[i].second, squared, is_wanted);
    }
    SurfaceField::Scratch scratch;
    for (int local = 0; local < kNodes; ++local) {
      const auto n = static_cast<std::size_t>(local);
      if (!is_wanted[n]) continue;
      const auto value = field_.at(position(brick.low + node_of(local)), brick.nearest[n], scratch);
      if (value) brick.height[n] = value->height;
    }
  }

  // Lets a node know the nearest of the samples within reach, and whether it is near the surface at all.
  void mark_nodes(Brick& brick, std::uint32_t sample, std::vector<float>& squared, std::vector<char>& is_wanted) const {
    const Eigen::Vector3f& point = samples_.cloud.positions[sample];
    const Eigen::Vector3f& normal = samples_.cloud.normals[sample];
    const float reach = kReachInWidths * samples_.width_mm[sample];
    const auto slab = kSlabInCells * static_cast<float>(cell_);
    const Eigen::Array3d in_nodes = (point.cast<double>() - origin_).array() / cell_ - brick.low.cast<double>();
    const double reach_in_nodes = static_cast<double>(reach) / cell_;
    const Eigen::Array3i first = (in_nodes - reach_in_nodes).ceil().cast<int>().max(0);
    const Eigen::Array3i last = (in_nodes + reach_in_nodes).floor().cast<int>().min(kSide - 1);
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        for (int x = first.x(); x <= last.x(); ++x) {
          const Eigen::Array3i node(x, y, z);
          const Eigen::Vector3f offset = position(brick.low + node) - point;
          const float distance = offset.squaredNorm();
          if (distance > reach * reach) continue;
          const auto n = static_cast<std::size_t>(local_of(node));
          if (distance < squared[n]) {
            squared[n] = distance;
            brick.nearest[n] = sample;
          }
          if (std::abs(normal.dot(offset)) <= slab) is_wanted[n] = 1;
        }
      }
    }
  }

  void find_crossings(Brick& brick) const {
    SurfaceField::Scratch scratch;
    for (int local = 0; local < kNodes; ++local) {
      const float from = brick.height[static_cast<std::size_t>(local)];
      if (std::isnan(from)) continue;
      const Eigen::Array3i node = node_of(local);
      for (int axis = 0; axis < 3; ++axis) {
        const auto [holder, next] = located(brick, node + unit(axis));
        if (!holder) continue;
        const float to = holder->height[static_cast<std::size_t>(next)];
        if (std::isnan(to) || (from < 0.0F) == (to < 0.0F)) continue;
        const std::array<std::uint32_t, 2> samples{brick.nearest[static_cast<std::size_t>(local)],
                                                   holder->nearest[static_cast<std::size_t>(next)]};
        Crossing crossing = crossing_of(brick.low + node, axis, {from, to}, samples, scratch);
        crossing.edge = 3 * local + axis;
        brick.crossings.push_back(crossing);
      }
    }
  }

  // By false position; on a face the first step is there already.
  [[nodiscard]] Crossing crossing_of(const Eigen::Array3i& node, int axis, std::array<float, 2> heights,
                                     std::array<std::uint32_t, 2> samples, SurfaceField::Scratch& scratch) const {
    const Eigen::Vector3f from = position(node), to = position(node + unit(axis));
    const auto cell = static_cast<float>(cell_);
    std::array<float, 2> ends{0.0F, 1.0F};
    Crossing crossing;
    for (int step = 0; step < 5; ++step) {
      const float share = std::clamp(heights[0] / (heights[0] - heights[1]), 0.1F, 0.9F);
      const float along = step == 0 ? heights[0] / (heights[0] - heights[1]) : ends[0] + share * (ends[1] - ends[0]);
      crossing.point = from + along * (to - from);
      const auto squared = [&](std::uint32_t s) {
        return (samples_.cloud.positions[s] - crossing.point).squaredNorm();
      };
      crossing.reference = squared(samples[0]) <= squared(samples[1]) ? samples[0] : samples[1];
      const auto value = field_.at(crossing.point, crossing.reference, scratch);
      if (!value) return crossing;
      crossing.normal = value->normal;
      crossing.is_on_surface = std::abs(value->height) < kOffSurfaceInCells * cell && value->nearest <= max_hole_;
      crossing.is_supported = crossing.is_on_surface && is_within_rim(*value);
      if (std::abs(value->height) < kConvergedInCells * cell) return crossing;
      const std::size_t end = (value->height < 0.0F) == (heights[0] < 0.0F) ? 0 : 1;
      ends[end] = along;
      heights[end] = value->height;
    }
    return crossing;
  }

  static bool is_within_rim(const FieldValue& value) {
    if (value.samples < kFewestSamples) return false;
    return value.nearest <= kBesideInWidths || value.imbalance < kAroundImbalance;
  }

  [[nodiscard]] const Crossing* crossing_at(const Brick& brick, const Eigen::Array3i& node, int axis) const {
    const auto [holder, local] = located(brick, node);
    if (!holder) return nullptr;
    const auto at = std::ranges::lower_bound(holder->crossings, 3 * local + axis, {}, &Crossing::edge);
    return at != holder->crossings.end() && at->edge == 3 * local + axis ? &*at : nullptr;
  }

  void place_vertices(Brick& brick) const {
    SurfaceField::Scratch scratch;
    for (int local = 0; local < kNodes; ++local) {
      const Eigen::Array3i cell = node_of(local);
      unsigned inside = 0;
      bool is_whole = true;
      for (int corner = 0; corner < 8 && is_whole; ++corner) {
        const float height = height_at(brick, cell + Eigen::Array3i(corner & 1, corner >> 1 & 1, corner >> 2));
        is_whole = !std::isnan(height);
        if (height < 0.0F) inside |= 1U << corner;
      }
      if (is_whole && inside != 0U && inside != 255U)
        brick.cells.push_back(cell_vertices(brick, local, inside, scratch));
    }
  }

  CellVertices cell_vertices(Brick& brick, int local, unsigned inside, SurfaceField::Scratch& scratch) const {
    const Eigen::Array3i cell = node_of(local);
    DisjointSets pieces = pieces_of_cell(inside);
    std::array<std::vector<const Crossing*>, kCellEdges> of_piece;
    CellVertices vertices{local, {}};
    vertices.vertex.fill(-1);
    for (int edge = 0; edge < kCellEdges; ++edge) {
      const Crossing* crossing = crossing_at(brick, start_of_edge(cell, edge), edge / 4);
      if (crossing && crossing->is_supported) of_piece[static_cast<std::size_t>(pieces.find(edge))].push_back(crossing);
    }
    for (int piece = 0; piece < kCellEdges; ++piece) {
      const auto& crossings = of_piece[static_cast<std::size_t>(piece)];
      if (crossings.empty()) continue;
      for (int edge = piece; edge < kCellEdges; ++edge) {
        if (pieces.find(edge) != piece) continue;
        vertices.vertex[static_cast<std::size_t>(edge)] = static_cast<int>(brick.vertices.size());
      }
      brick.vertices.push_back(vertex_of(brick.low + cell, crossings, scratch));
    }
    return vertices;
  }

  [[nodiscard]] Eigen::Vector3d vertex_of(const Eigen::Array3i& cell, const std::vector<const Crossing*>& crossings,
                                          SurfaceField::Scratch& scratch) const {
    const Eigen::Vector3d low = position(cell).cast<double>(), high = position(cell + 1).cast<double>();
    const VertexPlace place = nearest_to_planes(crossings);
    const Eigen::Vector3d point = place.point.cwiseMax(low).cwiseMin(high);
    if (place.is_on_edge) return point;
    // On a curved surface the mean of the crossings lies on a chord.
    const auto value = field_.at(point.cast<float>(), crossings.front()->reference, scratch);
    if (!value || std::abs(static_cast<double>(value->height)) > 0.5 * cell_) return point;
    return (point - static_cast<double>(value->height) * value->normal.cast<double>()).cwiseMax(low).cwiseMin(high);
  }

  [[nodiscard]] int vertex_at(const Brick& brick, const Eigen::Array3i& cell, int edge) const {
    const auto [holder, local] = located(brick, cell);
    if (!holder) return -1;
    const auto at = std::ranges::lower_bound(holder->cells, local, {}, &CellVertices::cell);
    if (at == holder->cells.end() || at->cell != local) return -1;
    const int vertex = at->vertex[static_cast<std::size_t>(edge)];
    return vertex < 0 ? -1 : holder->first_vertex + vertex;
  }

  [[nodiscard]] std::vector<Eigen::Vector3i> triangles_of(const Brick& brick,
                                                          const std::vector<Eigen::Vector3d>& vertices) const {
    std::vector<Eigen::Vector3i> triangles;
    for (const Crossing& crossing : brick.crossings) {
      // One that lacks support itself but has it all around is no rim: each of the cells has a vertex of its own.
      if (!crossing.is_on_surface) continue;
      const int axis = crossing.edge % 3;
      const Eigen::Array3i node = node_of(crossing.edge / 3), u = unit((axis + 1) % 3), v = unit((axis + 2) % 3);
      std::array<int, 4> quad{vertex_at(brick, node - u - v, 4 * axis + 3), vertex_at(brick, node - v, 4 * axis + 2),
                              vertex_at(brick, node, 4 * axis), vertex_at(brick, node - u, 4 * axis + 1)};
      if (std::ranges::min(quad) < 0) continue;
      if (!(brick.height[static_cast<std::size_t>(crossing.edge / 3)] < 0.0F)) std::swap(quad[1], quad[3]);
      // Cut along the diagonal that lies nearer to the surface: the one along an edge of the part.
      const auto off_surface = [&](std::size_t a, std::size_t b) {
        const auto at = [&](std::size_t k) { return vertices[static_cast<std::size_t>(quad[k])]; };
        const Eigen::Vector3d middle = 0.5 * (at(a) + at(b));
        return std::abs(crossing.normal.cast<double>().dot(middle - crossing.point.cast<double>()));
      };
      if (off_surface(0, 2) <= off_surface(1, 3)) {
        triangles.insert(triangles.end(), {{quad[0], quad[1], quad[2]}, {quad[0], quad[2], quad[3]}});
      } else {
        triangles.insert(triangles.end(), {{quad[0], quad[1], quad[3]}, {quad[1], quad[2], quad[3]}});
      }
    }
    return triangles;
  }

  const SurfaceField& field_;
  const FieldSamples& samples_;
  double cell_;
  float max_hole_;
  const Context& context_;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  std::vector<std::pair<VoxelKey, std::uint32_t>> pairs_;
  std::vector<VoxelKey> keys_;       // of the bricks, ascending
  std::vector<std::size_t> starts_;  // of each brick in pairs_; one more at the end
  std::vector<Brick> bricks_;
};

}  // namespace

TriangleMesh supported_surface(const SurfaceField& field, const FieldSamples& samples, double cell_mm,
                               double max_hole_widths, const Context& context) {
  return SparseSurface(field, samples, cell_mm, max_hole_widths, context).mesh();
}

}  // namespace asbuilt::fuse
