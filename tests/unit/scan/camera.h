// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/scan/normals.h"
#include "asbuilt/scan/point_density.h"

/// What a pinhole camera sees of a ball before a wall above a floor, by the roots of a quadratic: no mesh, no
/// simulator.
namespace asbuilt::test {

inline const Eigen::Vector3d kCamera(-40, 30, 0);
inline const Eigen::Vector3d kBall(20, 10, 600);  // mm; the camera looks along +z
inline constexpr double kBallRadius = 90.0, kWall = 900.0, kFloor = -160.0;

/// Distance along a ray to the first surface of the scene, infinity if there is none.
inline double range_along(const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  double range = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d to_ball = kBall - from;
  const double along = to_ball.dot(ray);
  const double root = along * along - to_ball.squaredNorm() + kBallRadius * kBallRadius;
  if (root > 0.0) range = along - std::sqrt(root);
  if (ray.z() > 0.0) range = std::min(range, (kWall - from.z()) / ray.z());
  if (ray.y() < 0.0) range = std::min(range, (kFloor - from.y()) / ray.y());
  return range;
}

/// One point a pixel, even in tangents to +-0.45.
inline std::vector<Eigen::Vector3f> seen_by_camera(const Eigen::Vector3d& at, int pixels_across = 150) {
  std::vector<Eigen::Vector3f> points;
  for (int row = 0; row < pixels_across; ++row) {
    for (int column = 0; column < pixels_across; ++column) {
      const double scale = 0.9 / pixels_across;
      const Eigen::Vector3d ray =
          Eigen::Vector3d((column + 0.5) * scale - 0.45, (row + 0.5) * scale - 0.45, 1.0).normalized();
      const double range = range_along(at, ray);
      if (std::isfinite(range)) points.push_back((at + range * ray).cast<float>());
    }
  }
  return points;
}

/// What a scanner on a tripod sees of a room 10 x 8 x 4 m with a pillar, in even steps of azimuth and of the angle from
/// the z axis, from 20 to 110 degrees. The room's floor is z = -1500 mm, its middle the origin.
inline std::vector<Eigen::Vector3f> seen_from_tripod(const Eigen::Vector3d& at, double step_deg) {
  const Eigen::Vector3d low(-5000, -4000, -1500), high(5000, 4000, 2500);
  const Eigen::Vector2d pillar(1000, 500);
  constexpr double kPillarRadius = 300.0, kDegree = 3.14159265358979323846 / 180.0;
  std::vector<Eigen::Vector3f> points;
  for (double zenith = 20.0; zenith < 110.0; zenith += step_deg) {
    for (double azimuth = 0.0; azimuth < 360.0; azimuth += step_deg) {
      const Eigen::Vector3d ray(std::sin(zenith * kDegree) * std::cos(azimuth * kDegree),
                                std::sin(zenith * kDegree) * std::sin(azimuth * kDegree), std::cos(zenith * kDegree));
      double range = std::numeric_limits<double>::infinity();
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        if (ray[axis] == 0.0) continue;
        range = std::min(range, ((ray[axis] > 0.0 ? high : low)[axis] - at[axis]) / ray[axis]);
      }
      const Eigen::Vector2d to_pillar = pillar - at.head<2>(), flat = ray.head<2>();
      const double a = flat.squaredNorm(), b = flat.dot(to_pillar);
      const double root = b * b - a * (to_pillar.squaredNorm() - kPillarRadius * kPillarRadius);
      if (root > 0.0 && b > 0.0) range = std::min(range, (b - std::sqrt(root)) / a);
      points.push_back((at + range * ray).cast<float>());
    }
  }
  return points;
}

/// The angle between neighbouring pixels amid the picture.
inline double pixel_angle(int pixels_across = 150) { return 0.9 / pixels_across; }

inline scan::PointDensity density_of(const std::vector<Eigen::Vector3f>& points, const Context& context) {
  const KdTree tree(points);
  const scan::FittedNormals fitted = scan::fitted_normals(points, tree, median_spacing(points, tree), 12, context);
  return {points, fitted.normals, fitted.variation, tree, 0.0, 2000, context};
}

}  // namespace asbuilt::test
