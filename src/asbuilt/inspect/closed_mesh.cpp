// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/closed_mesh.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/model/mesh_edges.h"
#include "asbuilt/model/surface_mesh.h"

namespace asbuilt::inspect {
namespace {

constexpr double kDamping = 1e-3;       // of directions that hardly differing normals tell, against a unit normal's one
constexpr double kLatticeFactor = 1.5;  // sum over neighbours of (u_i - u_j) / h = kLatticeFactor h times the Laplacian

/// The vertices of a surface mesh, which share no vertex across sharp edges, by their places.
struct Welding {
  std::vector<std::uint32_t> place_of_vertex;
  std::vector<std::uint32_t> order;  ///< vertices, those of a place side by side
  std::vector<std::size_t> starts;   ///< of each place in `order`; one more at the end

  [[nodiscard]] std::size_t places() const { return starts.size() - 1; }
};

Welding welded(const std::vector<Eigen::Vector3d>& vertices) {
  Welding welding;
  welding.order.resize(vertices.size());
  std::iota(welding.order.begin(), welding.order.end(), 0U);
  const auto coordinates = [&](std::uint32_t v) {
    return std::tuple(vertices[v].x(), vertices[v].y(), vertices[v].z());
  };
  std::ranges::sort(welding.order, [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(coordinates(a), a) < std::pair(coordinates(b), b);
  });
  welding.place_of_vertex.resize(vertices.size());
  for (std::size_t i = 0; i < welding.order.size(); ++i) {
    if (i == 0 || coordinates(welding.order[i]) != coordinates(welding.order[i - 1])) welding.starts.push_back(i);
    welding.place_of_vertex[welding.order[i]] = static_cast<std::uint32_t>(welding.starts.size() - 1);
  }
  welding.starts.push_back(welding.order.size());
  return welding;
}

/// Slivers of the CAD's tessellation have corners far closer than the points: the noise of neighbouring spots would
/// fold them. So deviations are averaged along edges, the more the shorter they are against `length_mm`.
void level_along_short_edges(std::vector<Spot>& spots, const model::SurfaceMesh& surface, double length_mm) {
  constexpr int kPasses = 3;
  constexpr double kShort = 0.3;  // of the length: what is averaged stays well below a usual triangle
  std::vector<std::pair<double, double>> sums(spots.size());
  for (int pass = 0; pass < kPasses; ++pass) {
    for (std::size_t v = 0; v < spots.size(); ++v) sums[v] = {static_cast<double>(spots[v].deviation_mm), 1.0};
    for (const auto& triangle : surface.triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
        if (!spots[a].is_scanned() || !spots[b].is_scanned()) continue;
        const double ratio = (surface.vertices[a] - surface.vertices[b]).norm() / (kShort * length_mm);
        const double weight = 0.5 * std::exp(-0.5 * ratio * ratio);  // an inner edge is met twice
        for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
          sums[to].first += weight * static_cast<double>(spots[from].deviation_mm);
          sums[to].second += weight;
        }
      }
    }
    for (std::size_t v = 0; v < spots.size(); ++v) {
      if (spots[v].is_scanned()) spots[v].deviation_mm = static_cast<float>(sums[v].first / sums[v].second);
    }
  }
}

/// Of a place of the surface.
struct Displacement {
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  float deviation_mm = std::numeric_limits<float>::quiet_NaN();  ///< the largest, if any was measured

  [[nodiscard]] bool is_measured() const { return !std::isnan(deviation_mm); }
};

/// The shortest displacement whose component along each measured normal is the deviation there.
Displacement displacement_of(std::span<const std::uint32_t> vertices, const std::vector<Eigen::Vector3f>& normals,
                             const std::vector<Spot>& spots) {
  Displacement result;
  Eigen::Matrix3d information = kDamping * Eigen::Matrix3d::Identity();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  int measured = 0;
  for (const std::uint32_t v : vertices) {
    if (!spots[v].is_scanned()) continue;
    const Eigen::Vector3d normal = normals[v].cast<double>();
    information += normal * normal.transpose();
    moment += static_cast<double>(spots[v].deviation_mm) * normal;
    if (measured++ == 0 || std::abs(spots[v].deviation_mm) > std::abs(result.deviation_mm)) {
      result.deviation_mm = spots[v].deviation_mm;
      if (measured == 1) result.vector = static_cast<double>(spots[v].deviation_mm) * normal;
    }
  }
  if (measured > 1) result.vector = solve_symmetric(information, moment);
  return result;
}

/// Displacements of the places that were not measured: (L + M / length^2) u = 0 with those measured given, where L is
/// the Laplacian of the mesh's edges, weighted by 1 / their lengths, and M what a unit mass matrix is in its terms.
void fill(std::vector<Displacement>& displacements, const std::vector<model::EdgeSide>& sides, const TriangleMesh& mesh,
          double return_length_mm) {
  std::vector<int> unknown_of(displacements.size(), -1);
  int unknowns = 0;
  for (std::size_t i = 0; i < displacements.size(); ++i) {
    if (!displacements[i].is_measured()) unknown_of[i] = unknowns++;
  }
  if (unknowns == 0) return;
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(unknowns), lengths = diagonal, degrees = diagonal;
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(unknowns, 3);
  std::vector<Eigen::Triplet<double>> entries;
  const double shortest = 1e-9 * diameter(mesh);
  model::for_each_edge(sides, [&](std::span<const model::EdgeSide> faces) {
    const std::uint32_t a = faces.front().low, b = faces.front().high;
    const double length = std::max(shortest, (mesh.vertices[a] - mesh.vertices[b]).norm());
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
      const int row = unknown_of[from];
      if (row < 0) continue;
      diagonal[row] += 1.0 / length;
      lengths[row] += length;
      degrees[row] += 1.0;
      if (unknown_of[to] >= 0) {
        entries.emplace_back(row, unknown_of[to], -1.0 / length);
      } else {
        right.row(row) += displacements[to].vector.transpose() / length;
      }
    }
  });
  for (int row = 0; row < unknowns; ++row) {
    const double length = degrees[row] > 0.0 ? lengths[row] / degrees[row] : return_length_mm;
    entries.emplace_back(row, row, diagonal[row] + kLatticeFactor * length / (return_length_mm * return_length_mm));
  }
  Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::MatrixX3d solution = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
  for (std::size_t i = 0; i < displacements.size(); ++i) {
    if (unknown_of[i] >= 0) displacements[i].vector = solution.row(unknown_of[i]).transpose();
  }
}

/// Loops of edges, each as its vertices, that close the mesh when triangles run them this way round. As many such edges
/// lead into a vertex as out of it, so each path ends where it began.
std::vector<std::vector<int>> open_loops(const std::vector<model::EdgeSide>& sides) {
  std::map<int, std::vector<int>> ends_from;  // edges that are wanted, from their first vertex
  model::for_each_edge(sides, [&](std::span<const model::EdgeSide> faces) {
    const auto up = std::ranges::count_if(faces, [](const model::EdgeSide& side) { return side.ascending; });
    const auto down = static_cast<std::ptrdiff_t>(faces.size()) - up;
    const int low = static_cast<int>(faces.front().low), high = static_cast<int>(faces.front().high);
    for (auto i = down; i < up; ++i) ends_from[high].push_back(low);
    for (auto i = up; i < down; ++i) ends_from[low].push_back(high);
  });
  std::vector<std::vector<int>> loops;
  std::vector<int> path;
  while (!ends_from.empty()) {
    path.assign(1, ends_from.begin()->first);
    for (;;) {
      const auto found = ends_from.find(path.back());
      if (found == ends_from.end()) break;  // the path has been used up, loop by loop
      const int next = found->second.back();
      found->second.pop_back();
      if (found->second.empty()) ends_from.erase(found);
      const auto seen = std::ranges::find(path, next);
      if (seen == path.end()) {
        path.push_back(next);
        continue;
      }
      loops.emplace_back(seen, path.end());
      path.erase(seen + 1, path.end());
    }
  }
  return loops;
}

/// A fan over each open loop.
void close_holes(ClosedMesh& closed, const std::vector<model::EdgeSide>& sides) {
  TriangleMesh& mesh = closed.mesh;
  for (const std::vector<int>& loop : open_loops(sides)) {
    ++closed.holes_closed;
    const auto add = [&](int a, int b, int c) {
      mesh.triangles.emplace_back(a, b, c);
      if (!mesh.cad_faces.empty()) mesh.cad_faces.push_back(-1);
    };
    if (loop.size() == 3) {
      add(loop[0], loop[1], loop[2]);
      continue;
    }
    const auto middle = static_cast<int>(mesh.vertices.size());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const int vertex : loop) sum += mesh.vertices[static_cast<std::size_t>(vertex)];
    mesh.vertices.emplace_back(sum / static_cast<double>(loop.size()));
    closed.deviation_mm.push_back(std::numeric_limits<float>::quiet_NaN());
    closed.filled.push_back(1);
    for (std::size_t i = 0; i < loop.size(); ++i) add(loop[i], loop[(i + 1) % loop.size()], middle);
  }
}

}  // namespace

Result<ClosedMesh> closed_mesh(const model::PreparedModel& model, const SpotFinder& finder,
                               const ClosedMeshOptions& options, const Context& context) {
  model::SurfaceMeshOptions splitting;
  splitting.edge_length_mm = options.edge_length_mm;
  splitting.max_triangles = std::max(options.max_triangles, model.skin.triangles.size());
  const model::SurfaceMesh surface = model::surface_mesh(model.skin, splitting);
  PointCloud places;
  for (const Eigen::Vector3d& vertex : surface.vertices) places.positions.push_back(vertex.cast<float>());
  places.normals = surface.normals;
  std::vector<Spot> spots = finder.detailed_at(places, context);
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while the mesh was closed");
  if (options.edge_length_mm > 0.0) level_along_short_edges(spots, surface, options.edge_length_mm);

  const Welding welding = welded(surface.vertices);
  ClosedMesh closed;
  std::vector<Displacement> displacements;
  for (std::size_t place = 0; place < welding.places(); ++place) {
    const auto vertices =
        std::span(welding.order).subspan(welding.starts[place], welding.starts[place + 1] - welding.starts[place]);
    displacements.push_back(displacement_of(vertices, surface.normals, spots));
    closed.mesh.vertices.push_back(surface.vertices[vertices.front()]);
  }
  if (std::ranges::none_of(displacements, &Displacement::is_measured)) {
    return fail(ErrorCode::not_possible, "nothing of the part was measured, so no closed mesh of it can be made");
  }
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const auto place = [&](std::size_t corner) {
      return static_cast<int>(welding.place_of_vertex[surface.triangles[i][corner]]);
    };
    const Eigen::Vector3i triangle(place(0), place(1), place(2));
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
    closed.mesh.triangles.push_back(triangle);
    if (!surface.faces.empty()) closed.mesh.cad_faces.push_back(static_cast<int>(surface.faces[i]));
  }
  const std::vector<model::EdgeSide> sides = model::sorted_sides(closed.mesh);
  fill(displacements, sides, closed.mesh, options.return_length_ratio * model.diameter);
  for (std::size_t i = 0; i < displacements.size(); ++i) {
    closed.mesh.vertices[i] += displacements[i].vector;
    closed.deviation_mm.push_back(displacements[i].deviation_mm);
    closed.filled.push_back(displacements[i].is_measured() ? 0 : 1);
  }
  close_holes(closed, sides);
  return closed;
}

}  // namespace asbuilt::inspect
