// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

// The nearest point of one triangle, for the searches of this folder.
namespace asbuilt::model {

/// A corner triple with its vertices by increasing index. Two triangles then compute the distance to the edge they
/// share by the very same operations, so that a tie between them is a tie to the last bit.
struct SortedTriangle {
  Eigen::Vector3d a, b, c;
  Eigen::Vector3d normal;  // of any length, by this order of the corners
  std::array<std::uint32_t, 3> vertices;
  std::array<std::uint32_t, 3> edges;  // ab, ac, bc
  std::uint32_t index;
  bool is_sliver;
};

/// Where on a triangle the nearest point lies; it decides which pseudonormal gives the sign.
enum class Feature : std::uint8_t { face, edge_ab, edge_ac, edge_bc, vertex_a, vertex_b, vertex_c };

struct Closest {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double squared_distance = std::numeric_limits<double>::infinity();
  Feature feature = Feature::face;
};

inline void try_segment(const Eigen::Vector3d& query, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                        Feature edge, Feature start, Feature end, Closest& best) {
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
inline Closest closest_on_triangle(const Eigen::Vector3d& query, const SortedTriangle& t) {
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
inline bool is_sliver(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return !((b - a).cross(c - a).norm() > 1e-9 * longest);
}

}  // namespace asbuilt::model
