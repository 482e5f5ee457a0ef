// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/ray_scene.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/parts.h"
#include "support/parts.h"

namespace asbuilt::test {

/// What a noiseless sensor at the origin sees along +z: a square image of tangents up to `half_width`.
inline scan::Scan seen(const std::vector<TriangleMesh>& meshes_in_scan, double half_width = 0.25,
                       double step = 0.0025) {
  const model::RayScene rays(meshes_in_scan);
  PointCloud cloud;
  for (double y = -half_width; y <= half_width; y += step) {
    for (double x = -half_width; x <= half_width; x += step) {
      const Eigen::Vector3d direction(x + 1e-5, y + 2e-5, 1.0);
      const auto hit = rays.first_hit(Eigen::Vector3d::Zero(), direction);
      if (hit.found()) cloud.positions.push_back((hit.distance * direction).cast<float>());
    }
  }
  const scan::ViewpointRequest origin{false, {scan::Viewpoint::Kind::point, Eigen::Vector3d::Zero()}};
  return scan::prepare_scan(cloud, std::nullopt, origin, {}, Context(2)).value();
}

inline Pose pose_at(const Eigen::Vector3d& where, const Eigen::Vector3d& turn = Eigen::Vector3d(2.3, 0.5, 0.4)) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_axis_angle(turn);
  pose.translation() = where;
  return pose;
}

/// A box's corner (+, +, +) straight ahead, so that three of its faces are seen.
inline Pose corner_ahead(double distance_mm) {
  const Eigen::Vector3d diagonal = Eigen::Vector3d::Ones().normalized(), towards_sensor = -Eigen::Vector3d::UnitZ();
  Pose pose(Eigen::AngleAxisd(std::acos(diagonal.dot(towards_sensor)), diagonal.cross(towards_sensor).normalized()));
  pose.translation() = Eigen::Vector3d(0, 0, distance_mm);
  return pose;
}

inline TriangleMesh plate_at(const Eigen::Vector3d& size, const Eigen::Vector3d& where) {
  return simulate::transformed(simulate::box(size), Pose(Eigen::Translation3d(where)));
}

/// Far behind the parts, wider than what is seen.
inline TriangleMesh wall() { return plate_at({2000, 2000, 10}, {0, 0, 1000}); }

inline model::PreparedModel prepared(const TriangleMesh& mesh, double ratio = 0.0) {
  model::ModelOptions options;
  options.sampling_ratio = ratio;
  return model::prepare(mesh, options, Context(2)).value();
}

}  // namespace asbuilt::test
