// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/resting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/simulate/mesh_edit.h"

namespace asbuilt::simulate {
namespace {

Eigen::Vector3d surface_centre(const TriangleMesh& mesh) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double area = 0.0;
  const std::vector<double> areas = vertex_areas(mesh);
  for (std::size_t i = 0; i < areas.size(); ++i) {
    sum += areas[i] * mesh.vertices[i];
    area += areas[i];
  }
  return area > 0.0 ? Eigen::Vector3d(sum / area) : sum;
}

double farthest(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& direction) {
  double reach = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& point : points) reach = std::max(reach, point.dot(direction));
  return reach;
}

// Some vertices of the convex hull: those that are farthest in directions spread over the sphere.
std::vector<Eigen::Vector3d> outermost(const TriangleMesh& mesh, const Eigen::Vector3d& centre) {
  constexpr int kDirections = 400;
  const std::size_t stride = std::max<std::size_t>(1, mesh.vertices.size() / 20000);
  std::vector<Eigen::Vector3d> found;
  for (int i = 0; i < kDirections; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections, angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double reach = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(reach * std::cos(angle), reach * std::sin(angle), z);
    std::size_t best = 0;
    for (std::size_t k = 0; k < mesh.vertices.size(); k += stride) {
      if (mesh.vertices[k].dot(direction) > mesh.vertices[best].dot(direction)) best = k;
    }
    found.push_back(mesh.vertices[best] - centre);
  }
  return found;
}

}  // namespace

Eigen::Matrix3d random_rotation(Random& random) {
  Eigen::Vector4d q;
  for (int k = 0; k < 4; ++k) q[k] = random.normal();
  q.normalize();
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
}

Eigen::Matrix3d resting_rotation(const TriangleMesh& mesh, Random& random) {
  const std::vector<Eigen::Vector3d> hull = outermost(mesh, surface_centre(mesh));
  Eigen::Vector3d down = random_rotation(random).col(2);
  double height = farthest(hull, down);
  for (double step = 0.2; step > 1e-4; step *= 0.7) {
    for (int tries = 0; tries < 12; ++tries) {
      const Eigen::Vector3d first = down.unitOrthogonal(), second = down.cross(first);
      const double angle = 2.0 * std::numbers::pi * tries / 12.0;
      const Eigen::Vector3d other = (down + step * (std::cos(angle) * first + std::sin(angle) * second)).normalized();
      const double other_height = farthest(hull, other);
      if (other_height >= height) continue;
      down = other;
      height = other_height;
    }
  }
  const Eigen::Matrix3d settled = rotation_between(down, -Eigen::Vector3d::UnitZ()).normalized().toRotationMatrix();
  const double yaw = random.uniform(0.0, 2.0 * std::numbers::pi);
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix() * settled;
}

double height_on_floor(const TriangleMesh& mesh, const Eigen::Matrix3d& world_from_mesh) {
  return farthest(mesh.vertices, -world_from_mesh.row(2).transpose());
}

}  // namespace asbuilt::simulate
