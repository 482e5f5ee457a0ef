// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/random.h"
#include "asbuilt/scan/scan.h"

/// Analytic clouds whose normals and noise are known.
namespace asbuilt::test {

/// A square in the plane z = `height`, centred on the z axis: about one point per `spacing`^2, shaken within its cell
/// so that no two neighbourhoods are alike, with normal noise of `sigma` along z.
inline PointCloud plane_cloud(double side, double spacing, double height, double sigma, std::uint64_t seed) {
  PointCloud cloud;
  Random random(seed, "plane", 0);
  const int count = static_cast<int>(side / spacing);
  for (int row = 0; row < count; ++row) {
    for (int column = 0; column < count; ++column) {
      const double x = (column + random.uniform(0.1, 0.9)) * spacing - 0.5 * side;
      const double y = (row + random.uniform(0.1, 0.9)) * spacing - 0.5 * side;
      const double z = height + sigma * random.normal();
      cloud.positions.push_back(Eigen::Vector3d(x, y, z).cast<float>());
    }
  }
  return cloud;
}

/// An even (Fibonacci) sphere around `centre`; only points with z of their normal above `lowest`; radial noise.
inline PointCloud sphere_cloud(const Eigen::Vector3d& centre, double radius, int count, double lowest, double sigma,
                               std::uint64_t seed) {
  PointCloud cloud;
  Random random(seed, "sphere", 0);
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - 2.0 * (i + 0.5) / count;
    const double noise = sigma * random.normal();
    if (z < lowest) continue;
    const double across = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d normal(across * std::cos(golden_angle * i), across * std::sin(golden_angle * i), z);
    cloud.positions.push_back((centre + (radius + noise) * normal).cast<float>());
  }
  return cloud;
}

inline scan::ViewpointRequest stated(scan::Viewpoint::Kind kind,
                                     const Eigen::Vector3d& value = Eigen::Vector3d::Zero()) {
  return {false, {kind, value}};
}

inline scan::ViewpointRequest from_point(double x, double y, double z) {
  return stated(scan::Viewpoint::Kind::point, {x, y, z});
}

/// Angle between two directions, degrees.
inline double degrees_between(const Eigen::Vector3f& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d c = a.cast<double>();
  return std::atan2(c.cross(b).norm(), c.dot(b)) * 180.0 / std::numbers::pi;
}

}  // namespace asbuilt::test
