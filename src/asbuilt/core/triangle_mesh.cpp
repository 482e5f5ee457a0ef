// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt {

Eigen::AlignedBox3d bounding_box(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    for (int corner = 0; corner < 3; ++corner) box.extend(mesh.vertices[static_cast<std::size_t>(triangle[corner])]);
  }
  return box;
}

double diameter(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  return box.isEmpty() ? 0.0 : box.diagonal().norm();
}

double surface_area(const TriangleMesh& mesh) {
  double doubled = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) doubled += doubled_area_vector(mesh, i).norm();
  return 0.5 * doubled;
}

}  // namespace asbuilt
