// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/surface_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/core/result.h"
#include "asbuilt/model/mesh_edges.h"
#include "asbuilt/model/triangle_screen.h"

namespace asbuilt::model {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kLeastPoints = 6;     // fewer are searched one by one
constexpr std::size_t kMostTriangles = 64;  // more are not worth a look at all of them for each point

double angle_at(const Eigen::Vector3d& corner, const Eigen::Vector3d& p, const Eigen::Vector3d& q) {
  const Eigen::Vector3d u = p - corner, v = q - corner;
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// The best of the triangles seen so far; ties go to the lower index.
struct Best {
  Closest closest;
  const SortedTriangle* triangle = nullptr;

  void offer(const Closest& other, const SortedTriangle& t) {
    if (other.squared_distance > closest.squared_distance) return;
    const bool is_tie = triangle != nullptr && other.squared_distance == closest.squared_distance;
    if (is_tie && t.index > triangle->index) return;
    closest = other;
    triangle = &t;
  }
};

}  // namespace

SurfaceSearch::SurfaceSearch(const TriangleMesh& mesh) : bvh_(mesh) {
  fill_normals(mesh);
  number_edges(mesh);
  order_triangles(mesh);
}

// Angle-weighted vertex normals; equation 5 of Baerentzen and Aanaes.
void SurfaceSearch::fill_normals(const TriangleMesh& mesh) {
  face_normals_.resize(mesh.triangles.size());
  vertex_normals_.assign(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    face_normals_[i] = doubled_area_vector(mesh, i).stableNormalized();
    for (int corner = 0; corner < 3; ++corner) {
      const auto vertex = [&](int k) { return static_cast<std::size_t>(mesh.triangles[i][(corner + k) % 3]); };
      const double angle = angle_at(mesh.vertices[vertex(0)], mesh.vertices[vertex(1)], mesh.vertices[vertex(2)]);
      vertex_normals_[vertex(0)] += angle * face_normals_[i];
    }
  }
}

void SurfaceSearch::number_edges(const TriangleMesh& mesh) {
  edges_of_triangle_.resize(mesh.triangles.size());
  vertex_is_open_.assign(mesh.vertices.size(), 0);
  for_each_edge(sorted_sides(mesh), [&](std::span<const EdgeSide> faces) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (const EdgeSide& side : faces) {
      normal += face_normals_[side.triangle];
      edges_of_triangle_[side.triangle][side.corner] = static_cast<std::uint32_t>(edge_normals_.size());
    }
    const bool is_open = faces.size() == 1;
    edge_normals_.push_back(normal);
    edge_is_open_.push_back(is_open ? 1 : 0);
    if (is_open) vertex_is_open_[faces[0].low] = vertex_is_open_[faces[0].high] = 1;
  });
}

void SurfaceSearch::order_triangles(const TriangleMesh& mesh) {
  triangles_.reserve(mesh.triangles.size());
  place_of_.resize(mesh.triangles.size());
  for (const std::uint32_t index : bvh_.order()) {
    const Eigen::Vector3i& corners = mesh.triangles[index];
    std::array<int, 3> by_vertex{0, 1, 2};
    std::ranges::sort(by_vertex, {}, [&](int corner) { return corners[corner]; });
    const auto edge_between = [&](int p, int q) {
      const int first = (p + 1) % 3 == q ? p : q;  // the corner that the side starts from
      return edges_of_triangle_[index][static_cast<std::size_t>(first)];
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
    place_of_[index] = static_cast<std::uint32_t>(triangles_.size());
    triangles_.push_back(t);
  }
  edges_of_triangle_ = {};
}

SurfaceSearch::Nearest SurfaceSearch::described(const Eigen::Vector3d& query, const SortedTriangle& t,
                                                const Closest& closest) const {
  const Eigen::Vector3d* pseudonormal = &face_normals_[t.index];
  bool is_open = false;
  const int feature = static_cast<int>(closest.feature);
  if (feature >= static_cast<int>(Feature::vertex_a)) {
    const std::uint32_t vertex = t.vertices[static_cast<std::size_t>(feature - static_cast<int>(Feature::vertex_a))];
    pseudonormal = &vertex_normals_[vertex];
    is_open = vertex_is_open_[vertex] != 0;
  } else if (feature >= static_cast<int>(Feature::edge_ab)) {
    const std::uint32_t edge = t.edges[static_cast<std::size_t>(feature - static_cast<int>(Feature::edge_ab))];
    pseudonormal = &edge_normals_[edge];
    is_open = edge_is_open_[edge] != 0;
  }
  const double distance = std::sqrt(closest.squared_distance);
  const bool is_inside = (query - closest.point).dot(*pseudonormal) < 0.0;
  return {is_inside ? -distance : distance, closest.point, t.index, is_open};
}

SurfaceSearch::Nearest SurfaceSearch::nearest(const Eigen::Vector3d& point, double squared_reach_mm2,
                                              std::optional<std::uint32_t> guess) const {
  Best best;
  best.closest.squared_distance = squared_reach_mm2;
  if (guess && *guess < triangles_.size()) {
    best.triangle = &triangles_[place_of_[*guess]];
    best.closest = closest_on_triangle(point, *best.triangle);
  }
  bvh_.visit_nearest(point, best.closest.squared_distance, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end; ++i) best.offer(closest_on_triangle(point, triangles_[i]), triangles_[i]);
    return best.closest.squared_distance;
  });
  return best.triangle == nullptr ? Nearest{} : described(point, *best.triangle, best.closest);
}

std::vector<SurfaceSearch::Nearest> SurfaceSearch::one_by_one(std::span<const Eigen::Vector3d> points) const {
  std::vector<Nearest> found;
  found.reserve(points.size());
  std::optional<std::uint32_t> guess;
  for (const Eigen::Vector3d& point : points) {
    found.push_back(point.allFinite() ? nearest(point, kInfinity, guess) : Nearest{});
    if (found.back().found()) guess = found.back().triangle;
  }
  return found;
}

std::vector<SurfaceSearch::Nearest> SurfaceSearch::nearest_of_cluster(std::span<const Eigen::Vector3d> points) const {
  if (points.size() < kLeastPoints || triangles_.empty()) return one_by_one(points);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& point : points) {
    if (!point.allFinite()) return one_by_one(points);
    box.extend(point);
  }
  const Eigen::Vector3d centre = box.center();
  const double radius = 0.5 * box.diagonal().norm();
  // No point is further than its distance to the centre from what is nearest there, so none has its own nearest
  // triangle further than twice that from the centre's.
  const double reach = (std::abs(nearest(centre, kInfinity).signed_distance) + 2.0 * radius) * (1.0 + 1e-9);
  TriangleScreen screen(centre, radius + reach);
  std::array<const SortedTriangle*, kMostTriangles> chosen{};
  std::size_t count = 0;
  bool too_many = false;
  bvh_.visit_nearest(centre, reach * reach, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t i = begin; i < end && !too_many; ++i) {
      if (closest_on_triangle(centre, triangles_[i]).squared_distance > reach * reach) continue;
      too_many = count == kMostTriangles;
      if (too_many) break;
      chosen[count++] = &triangles_[i];
      screen.add(triangles_[i]);
    }
    return too_many ? 0.0 : reach * reach;
  });
  if (too_many) return one_by_one(points);

  std::vector<Nearest> found;
  found.reserve(points.size());
  for (const Eigen::Vector3d& point : points) {
    Best best;
    screen.visit_near(point, [&](std::size_t i) {
      best.offer(closest_on_triangle(point, *chosen[i]), *chosen[i]);
      return best.closest.squared_distance;
    });
    found.push_back(described(point, *best.triangle, best.closest));
  }
  return found;
}

}  // namespace asbuilt::model
