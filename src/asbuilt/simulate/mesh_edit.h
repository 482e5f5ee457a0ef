// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/random.h"
#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::simulate {

/// The mesh moved: `to_from_mesh` applied to every vertex.
[[nodiscard]] TriangleMesh transformed(const TriangleMesh& mesh, const Pose& to_from_mesh);

/// The mesh scaled about the origin; a negative factor on an odd number of axes keeps the winding outward.
[[nodiscard]] TriangleMesh scaled(const TriangleMesh& mesh, const Eigen::Vector3d& factors);

/// All meshes in one, vertices not shared between them.
[[nodiscard]] TriangleMesh merged(std::span<const TriangleMesh> meshes);

/// Vertices at exactly the same position made one (the lowest index stays); unused ones and collapsed triangles go.
[[nodiscard]] TriangleMesh welded(const TriangleMesh& mesh);

/// Splits edges at their middles until none is longer than `max_edge_mm(middle of the edge)`. Neighbouring triangles
/// share the new vertices, so a closed mesh stays closed. The surface does not change.
[[nodiscard]] TriangleMesh subdivided(const TriangleMesh& mesh,
                                      const std::function<double(const Eigen::Vector3d&)>& max_edge_mm);

/// Unit normals of the vertices, faces weighted by area; zero where no face has one.
[[nodiscard]] std::vector<Eigen::Vector3d> vertex_normals(const TriangleMesh& mesh);

/// A third of the area of the faces around each vertex, mm^2.
[[nodiscard]] std::vector<double> vertex_areas(const TriangleMesh& mesh);

/// A point of a surface and where its face looks.
struct SurfacePoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;
};

/// `count` points, each standing for the same area: strata of equal area, one uniform point in each.
[[nodiscard]] std::vector<SurfacePoint> area_samples(const TriangleMesh& mesh, std::size_t count, Random random);

}  // namespace asbuilt::simulate
