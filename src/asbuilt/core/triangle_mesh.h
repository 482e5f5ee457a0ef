// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace asbuilt {

/// An indexed triangle mesh in millimetres. Invariants: every index is in [0, vertices.size()); `cad_faces` is empty or as
/// long as `triangles`.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;
  std::vector<int> cad_faces = {};  ///< the CAD face that each triangle is a piece of; empty for mere meshes

  [[nodiscard]] bool empty() const { return triangles.empty(); }
};

/// Axis-aligned box around the vertices that triangles use; empty box for an empty mesh.
[[nodiscard]] Eigen::AlignedBox3d bounding_box(const TriangleMesh& mesh);

/// Diagonal of the bounding box: what this project calls the diameter of a part, in mm.
[[nodiscard]] double diameter(const TriangleMesh& mesh);

/// Cross product of two edges: twice the area long, along the face normal by the right-hand rule.
[[nodiscard]] inline Eigen::Vector3d doubled_area_vector(const TriangleMesh& mesh, std::size_t triangle) {
  const Eigen::Vector3i& t = mesh.triangles[triangle];
  const Eigen::Vector3d& a = mesh.vertices[static_cast<std::size_t>(t[0])];
  const Eigen::Vector3d& b = mesh.vertices[static_cast<std::size_t>(t[1])];
  const Eigen::Vector3d& c = mesh.vertices[static_cast<std::size_t>(t[2])];
  return (b - a).cross(c - a);
}

[[nodiscard]] double surface_area(const TriangleMesh& mesh);

}  // namespace asbuilt
