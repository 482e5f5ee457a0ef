// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/surface_distance.h"

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/model/mesh_edges.h"
#include "asbuilt/model/triangle_bvh.h"

namespace asbuilt::model {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A corner triple with its vertices by increasing index. Two triangles then compute the distance to the edge they
// share by the very same operations, so that a tie between them is a tie to the last bit.
struct SortedTriangle {
  Eigen::Vector3d a, b, c;
  Eigen::Vector3d normal;  // of any length, by this order of the corners
  std::array<std::uint32_t, 3> vertices;
  std::array<std::uint32_t, 3> edges;  // ab, ac, bc
  std::uint32_t index;
  bool is_sliver;
};

// Where on a triangle the nearest point lies; it decides which pseudonormal gives the sign.
enum class Feature : std::uint8_t { face, edge_ab, edge_ac, edge_bc, vertex_a, vertex_b, vertex_c };

struct Closest {
  Eigen::Vector3d point;
  double squared_distance = kInfinity;
  Feature feature = Feature::face;
};

void try_segment(const Eigen::Vector3d& query, const Eigen::Vector3d& from, const Eigen::Vector3d& to, Feature edge,
                 Feature start, Feature end, Closest& best) {
  const Eigen::Vector3d along = to - from;
  const double squared_length = along.squaredNorm();
  const double t = squared_length > 0.0 ? (query - from).dot(along) / squared_length : 0.0;
  Closest candidate;
  if (t <= 0.0) {
    candidate = {from, 0.0, start};
  } else if (t >= 1.0) {
    candidate = {to, 0.0, end};
  } else {
    candidate = {from + t * along, 0.0, edge};
  }
  candidate.squared_distance = (query - candidate.point).squaredNorm();
  if (candidate.squared_distance < best.squared_distance) best = candidate;
}

// The foot of the perpendicular if it falls inside, else the best of the edges that it falls beyond. No Voronoi regions
// are told apart by differences of products, which cancel on slivers; for those all three edges are tried.
Closest closest_on_triangle(const Eigen::Vector3d& query, const SortedTriangle& t) {
  const Eigen::Vector3d from_a = query - t.a;
  const bool beyond_ab = t.normal.dot((t.b - t.a).cross(from_a)) <= 0.0;
  const bool beyond_bc = t.normal.dot((t.c - t.b).cross(query - t.b)) <= 0.0;
  const bool beyond_ca = t.normal.dot((t.a - t.c).cross(from_a)) <= 0.0;
  if (!t.is_sliver && !beyond_ab && !beyond_bc && !beyond_ca) {
    const Eigen::Vector3d offset = from_a.dot(t.normal) / t.normal.squaredNorm() * t.normal;
    return {query - offset, offset.squaredNorm(), Feature::face};
  }
  Closest best;
  if (beyond_ab || t.is_sliver)
    try_segment(query, t.a, t.b, Feature::edge_ab, Feature::vertex_a, Feature::vertex_b, best);
  if (beyond_ca || t.is_sliver)
    try_segment(query, t.a, t.c, Feature::edge_ac, Feature::vertex_a, Feature::vertex_c, best);
  if (beyond_bc || t.is_sliver)
    try_segment(query, t.b, t.c, Feature::edge_bc, Feature::vertex_b, Feature::vertex_c, best);
  return best;
}

// A triangle so low that its normal is mostly rounding. Its inside is then as near as its edges, to that rounding.
bool is_sliver(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return !((b - a).cross(c - a).norm() > 1e-9 * longest);
}

double angle_at(const Eigen::Vector3d& corner, const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  const Eigen::Vector3d u = p - corner, v = q - corner;
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

}  // namespace

struct SurfaceDistance::Implementation {
  std::vector<SortedTriangle> triangles;  // in the order of the hierarchy's leaves
  std::vector<std::uint32_t> place_of;    // of a mesh triangle in that order
  std::vector<Eigen::Vector3d> face_normals, edge_normals, vertex_normals;
  std::vector<std::uint8_t> edge_is_open, vertex_is_open;
  TriangleBvh bvh;

  explicit Implementation(const TriangleMesh& mesh) : bvh(mesh) {
    fill_normals(mesh);
    number_edges(mesh);
    order_triangles(mesh);
  }

  // Angle-weighted vertex normals; equation 5 of Baerentzen and Aanaes.
  void fill_normals(const TriangleMesh& mesh) {
    face_normals.resize(mesh.triangles.size());
    vertex_normals.assign(mesh.vertices.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      face_normals[i] = doubled_area_vector(mesh, i).stableNormalized();
      for (int corner = 0; corner < 3; ++corner) {
        const auto vertex = [&](int k) { return static_cast<std::size_t>(mesh.triangles[i][(corner + k) % 3]); };
        const double angle = angle_at(mesh.vertices[vertex(0)], mesh.vertices[vertex(1)], mesh.vertices[vertex(2)]);
        vertex_normals[vertex(0)] += angle * face_normals[i];
      }
    }
  }

  std::vector<std::array<std::uint32_t, 3>> edges_of_triangle;  // by the corner a side starts from; only while building

  void number_edges(const TriangleMesh& mesh) {
    edges_of_triangle.resize(mesh.triangles.size());
    vertex_is_open.assign(mesh.vertices.size(), 0);
    for_each_edge(sorted_sides(mesh), [&](std::span<const EdgeSide> faces) {
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      for (const EdgeSide& side : faces) {
        normal += face_normals[side.triangle];
        edges_of_triangle[side.triangle][side.corner] = static_cast<std::uint32_t>(edge_normals.size());
      }
      const bool is_open = faces.size() == 1;
      edge_normals.push_back(normal);
      edge_is_open.push_back(is_open ? 1 : 0);
      if (is_open) vertex_is_open[faces[0].low] = vertex_is_open[faces[0].high] = 1;
    });
  }

  void order_triangles(const TriangleMesh& mesh) {
    triangles.reserve(mesh.triangles.size());
    place_of.resize(mesh.triangles.size());
    for (const std::uint32_t index : bvh.order()) {
      const Eigen::Vector3i& corners = mesh.triangles[index];
      std::array<int, 3> by_vertex{0, 1, 2};
      std::ranges::sort(by_vertex, {}, [&](int corner) { return corners[corner]; });
      const auto edge_between = [&](int p, int q) {
        const int first = (p + 1) % 3 == q ? p : q;  // the corner that the side starts from
        return edges_of_triangle[index][static_cast<std::size_t>(first)];
      };
      const auto vertex = [&](std::size_t k) { return static_cast<std::uint32_t>(corners[by_vertex[k]]); };
      SortedTriangle t;
      t.vertices = {vertex(0), vertex(1), vertex(2)};
      t.a = mesh.vertices[t.vertices[0]];
      t.b = mesh.vertices[t.vertices[1]];
      t.c = mesh.vertices[t.vertices[2]];
      t.normal = (t.b - t.a).cross(t.c - t.a);
      t.edges = {edge_between(by_vertex[0], by_vertex[1]), edge_between(by_vertex[0], by_vertex[2]),
                 edge_between(by_vertex[1], by_vertex[2])};
      t.index = index;
      t.is_sliver = is_sliver(t.a, t.b, t.c);
      place_of[index] = static_cast<std::uint32_t>(triangles.size());
      triangles.push_back(t);
    }
    edges_of_triangle = {};
  }

  // `guess`, if there is one, only shortens the search.
  [[nodiscard]] Nearest search(const Eigen::Vector3d& point, double squared_reach, const SortedTriangle* guess) const {
    Closest best;
    const SortedTriangle* winner = guess;
    if (guess != nullptr) {
      best = closest_on_triangle(point, *guess);
      squared_reach = best.squared_distance;
    }
    bvh.visit_nearest(point, squared_reach, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const Closest closest = closest_on_triangle(point, triangles[i]);
        if (closest.squared_distance > squared_reach) continue;
        const bool is_tie = winner != nullptr && closest.squared_distance == best.squared_distance;
        if (is_tie && triangles[i].index > winner->index) continue;
        best = closest;
        winner = &triangles[i];
        squared_reach = closest.squared_distance;
      }
      return squared_reach;
    });
    return winner == nullptr ? Nearest{} : describe(point, *winner, best);
  }

  [[nodiscard]] Nearest describe(const Eigen::Vector3d& query, const SortedTriangle& t, const Closest& closest) const {
    const Eigen::Vector3d* pseudonormal = &face_normals[t.index];
    bool is_open = false;
    const int feature = static_cast<int>(closest.feature);
    if (feature >= static_cast<int>(Feature::vertex_a)) {
      const std::uint32_t vertex = t.vertices[static_cast<std::size_t>(feature - static_cast<int>(Feature::vertex_a))];
      pseudonormal = &vertex_normals[vertex];
      is_open = vertex_is_open[vertex] != 0;
    } else if (feature >= static_cast<int>(Feature::edge_ab)) {
      const std::uint32_t edge = t.edges[static_cast<std::size_t>(feature - static_cast<int>(Feature::edge_ab))];
      pseudonormal = &edge_normals[edge];
      is_open = edge_is_open[edge] != 0;
    }
    const double distance = std::sqrt(closest.squared_distance);
    const bool is_inside = (query - closest.point).dot(*pseudonormal) < 0.0;
    return {is_inside ? -distance : distance, closest.point, t.index, is_open};
  }
};

SurfaceDistance::SurfaceDistance(const TriangleMesh& mesh) : implementation_(std::make_unique<Implementation>(mesh)) {}
SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;

SurfaceDistance::Nearest SurfaceDistance::nearest(const Eigen::Vector3d& point, double max_distance) const {
  if (!point.allFinite() || !(max_distance >= 0.0)) return {};
  const double squared_reach = std::isinf(max_distance) ? kInfinity : max_distance * max_distance;
  return implementation_->search(point, squared_reach, nullptr);
}

SurfaceDistance::Nearest SurfaceDistance::nearest_from_guess(const Eigen::Vector3d& point, std::uint32_t guess) const {
  if (!point.allFinite() || guess >= implementation_->triangles.size()) return nearest(point);
  return implementation_->search(point, kInfinity, &implementation_->triangles[implementation_->place_of[guess]]);
}

}  // namespace asbuilt::model
