// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/sorted_triangle.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/model/triangle_bvh.h"

namespace asbuilt::model {

/// What stands behind SurfaceDistance, for callers that have many points. Built once, then const and safe from any
/// thread.
class SurfaceSearch {
 public:
  using Nearest = SurfaceDistance::Nearest;

  /// As SurfaceDistance: the mesh should be welded.
  explicit SurfaceSearch(const TriangleMesh& mesh);

  /// The nearest surface point whose squared distance is at most `squared_reach_mm2`. `guess`, if there is one, is a
  /// triangle of the mesh; it takes the place of the reach and only shortens the search.
  [[nodiscard]] Nearest nearest(const Eigen::Vector3d& point, double squared_reach_mm2,
                                std::optional<std::uint32_t> guess = {}) const;

  /// The nearest surface points of points that lie close together, in their order: to the last bit those of nearest().
  ///
  /// The hierarchy is asked once, for the triangles that can be the nearest to any point of the ball about them all;
  /// of these a bound in float leaves one or two a point for the exact distance. Where the triangles are too many for
  /// that, each point is searched on its own. Cost: about 0.1 us a point for 50 points on a surface whose triangles are
  /// about as large as the cluster.
  [[nodiscard]] std::vector<Nearest> nearest_of_cluster(std::span<const Eigen::Vector3d> points) const;

 private:
  void fill_normals(const TriangleMesh& mesh);
  void number_edges(const TriangleMesh& mesh);
  void order_triangles(const TriangleMesh& mesh);
  [[nodiscard]] std::vector<Nearest> one_by_one(std::span<const Eigen::Vector3d> points) const;
  [[nodiscard]] Nearest described(const Eigen::Vector3d& query, const SortedTriangle& t, const Closest& closest) const;

  std::vector<SortedTriangle> triangles_;  // in the order of the hierarchy's leaves
  std::vector<std::uint32_t> place_of_;    // of a mesh triangle in that order
  std::vector<Eigen::Vector3d> face_normals_, edge_normals_, vertex_normals_;
  std::vector<std::uint8_t> edge_is_open_, vertex_is_open_;
  std::vector<std::array<std::uint32_t, 3>> edges_of_triangle_;  // by the corner a side starts from; while building
  TriangleBvh bvh_;
};

}  // namespace asbuilt::model
