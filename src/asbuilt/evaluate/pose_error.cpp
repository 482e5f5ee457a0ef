// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/pose_error.h"

#include <algorithm>
#include <numbers>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt::evaluate {
namespace {

std::vector<Eigen::Vector3d> used_vertices(const TriangleMesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k) used[static_cast<std::size_t>(triangle[k])] = true;
  }
  std::vector<Eigen::Vector3d> vertices;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) vertices.push_back(mesh.vertices[i]);
  }
  return vertices;
}

PoseError error_of(const Pose& ours_from_true, const std::vector<Eigen::Vector3d>& vertices,
                   const Eigen::Vector3d& centre) {
  PoseError error;
  error.angle_deg = rotation_angle(ours_from_true.linear()) * 180.0 / std::numbers::pi;
  error.translation_mm = (ours_from_true * centre - centre).norm();
  for (const Eigen::Vector3d& vertex : vertices) {
    const double displacement = (ours_from_true * vertex - vertex).norm();
    error.add_mm += displacement / static_cast<double>(vertices.size());
    error.max_vertex_mm = std::max(error.max_vertex_mm, displacement);
  }
  return error;
}

}  // namespace

PoseError pose_error(const Pose& model_from_scan, const Pose& true_model_from_scan, const TriangleMesh& model,
                     std::span<const Pose> symmetries) {
  ASBUILT_EXPECT(!model.empty(), "a model with triangles");
  const std::vector<Eigen::Vector3d> vertices = used_vertices(model);
  const Eigen::Vector3d centre = bounding_box(model).center();
  const Pose ours_from_true = model_from_scan * true_model_from_scan.inverse();
  PoseError best = error_of(ours_from_true, vertices, centre);
  for (std::size_t i = 0; i < symmetries.size(); ++i) {
    PoseError error = error_of(symmetries[i].inverse() * ours_from_true, vertices, centre);
    error.symmetry = i;
    if (error.max_vertex_mm < best.max_vertex_mm) best = error;
  }
  return best;
}

PoseError pose_error(const Pose& model_from_scan, const Pose& true_model_from_scan, const TriangleMesh& model,
                     const model::SymmetryGroup& group) {
  const Pose ours_from_true = model_from_scan * true_model_from_scan.inverse();
  const Pose element = group.closest_element(ours_from_true, bounding_box(model));
  return pose_error(model_from_scan, element * true_model_from_scan, model);
}

}  // namespace asbuilt::evaluate
