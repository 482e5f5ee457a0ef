// SPDX-License-Identifier: Apache-2.0
#pragma once

// A closed, smooth, asymmetric body made of a formula, and noisy views of it whose true poses are known.

#include <cmath>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/random.h"
#include "asbuilt/refine/refine.h"

namespace asbuilt::test {

/// Radius over direction d: 50 (1 + bumps(d)) mm; no rotation maps it onto itself.
inline double body_radius(const Eigen::Vector3d& d) {
  return 50.0 * (1.0 + 0.15 * d.x() * d.y() + 0.1 * d.z() * d.z() * d.x() + 0.04 * std::sin(5.0 * d.x() + 1.0) +
                 0.04 * std::cos(6.0 * d.y() - 0.5) + 0.04 * std::sin(7.0 * d.z()));
}

/// Outward normal at direction d, from the gradient of |x| - radius(x / |x|) by central differences.
inline Eigen::Vector3d body_normal(const Eigen::Vector3d& d) {
  const Eigen::Vector3d x = body_radius(d) * d;
  const auto level = [](const Eigen::Vector3d& point) { return point.norm() - body_radius(point.normalized()); };
  Eigen::Vector3d gradient;
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    step[i] = 1e-4;
    gradient[i] = (level(x + step) - level(x - step)) / 2e-4;
  }
  return gradient.normalized();
}

inline Eigen::Vector3d random_direction(Random& random) {
  Eigen::Vector3d d;
  do {
    d = {random.normal(), random.normal(), random.normal()};
  } while (d.norm() < 1e-3);
  return d.normalized();
}

inline Pose random_pose(Random& random, double max_angle, double max_shift) {
  Vector6d twist;
  twist.head<3>() = random_direction(random) * random.uniform(0.0, max_angle);
  twist.tail<3>() = random_direction(random) * random.uniform(0.0, max_shift);
  return pose_from_twist(twist);
}

struct Scene {
  std::vector<refine::View> views;  // poses are the starting ones
  std::vector<Pose> truth;          // model_from_scan
  std::vector<refine::Link> links;  // all pairs whose sensors stand less than 100 degrees apart
  double diameter = 100.0;          // of the body, about
};

struct SceneOptions {
  int views = 6;
  int points = 8000;           // drawn over the whole body, about a third is seen by a view
  double sigma = 0.1;          // mm, along the line of sight
  double normal_noise = 0.03;  // rad, each axis
  double start_error = 1.0;    // mm at the body's surface, about: half of it shift, half rotation
  double alike_error = 0.0;    // mm, along the line of sight: a wave half as long as the radius, of each view
};

inline PointCloud body_seen_from(const Eigen::Vector3d& sensor_direction, int points, double sigma, double normal_noise,
                                 Random& random) {
  PointCloud cloud;
  for (int i = 0; i < points; ++i) {
    const Eigen::Vector3d d = random_direction(random);
    const Eigen::Vector3d normal = body_normal(d);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    const double along = sigma * random.normal();
    if (normal.dot(sensor_direction) < 0.25) continue;
    cloud.positions.push_back((body_radius(d) * d + along * sensor_direction).cast<float>());
    cloud.normals.push_back((normal + normal_noise * noise).normalized().cast<float>());
  }
  return cloud;
}

inline Scene bumpy_scene(const SceneOptions& options, std::uint64_t seed) {
  Scene scene;
  std::vector<Eigen::Vector3d> sensors;
  for (int v = 0; v < options.views; ++v) {
    Random random(seed, "bumpy view", static_cast<std::uint64_t>(v));
    const double turn = 2.0 * 3.14159265358979 * v / options.views;
    const double tilt = (v % 2 == 0) ? 0.5 : -0.5;
    sensors.push_back(Eigen::Vector3d(std::cos(turn), std::sin(turn), tilt).normalized());
    PointCloud in_model = body_seen_from(sensors.back(), options.points, options.sigma, options.normal_noise, random);
    if (options.alike_error > 0.0) {
      const Eigen::Vector3d wave = random_direction(random) * (2.0 * 3.14159265358979 / 25.0);
      const double phase = random.uniform(0.0, 6.28);
      for (Eigen::Vector3f& p : in_model.positions) {
        const double along = options.alike_error * std::sqrt(2.0) * std::sin(wave.dot(p.cast<double>()) + phase);
        p += (along * sensors.back()).cast<float>();
      }
    }
    const Pose truth = random_pose(random, 3.0, 300.0);
    refine::View view;
    for (std::size_t i = 0; i < in_model.size(); ++i) {
      view.segment_in_scan.positions.push_back((truth.inverse() * in_model.positions[i].cast<double>()).cast<float>());
      view.segment_in_scan.normals.push_back(
          (truth.linear().transpose() * in_model.normals[i].cast<double>()).cast<float>());
    }
    Vector6d error;
    error.head<3>() = random_direction(random) * (0.5 * options.start_error / 50.0);
    error.tail<3>() = random_direction(random) * (0.5 * options.start_error);
    view.model_from_scan = pose_from_twist(error) * truth;
    view.noise_sigma_mm = options.sigma;
    scene.truth.push_back(truth);
    scene.views.push_back(view);
  }
  for (int a = 0; a < options.views; ++a) {
    for (int b = a + 1; b < options.views; ++b) {
      const double cosine = sensors[static_cast<std::size_t>(a)].dot(sensors[static_cast<std::size_t>(b)]);
      if (cosine > std::cos(100.0 * 3.14159265358979 / 180.0)) scene.links.push_back({a, b});
    }
  }
  return scene;
}

/// RMS over all points of |G T_ours p - T_true p| with the one common G that makes it least: the project's relative
/// pose error.
inline double relative_pose_error(const Scene& scene, const std::vector<Pose>& ours) {
  std::vector<Eigen::Vector3d> from, to;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const auto& positions = scene.views[v].segment_in_scan.positions;
    for (std::size_t i = 0; i < positions.size(); i += 7) {
      from.push_back(ours[v] * positions[i].cast<double>());
      to.push_back(scene.truth[v] * positions[i].cast<double>());
    }
  }
  const Pose common = best_rigid_motion(from, to);
  double squares = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) squares += (common * from[i] - to[i]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(from.size()));
}

inline std::vector<Pose> starting_poses(const Scene& scene) {
  std::vector<Pose> poses;
  for (const refine::View& view : scene.views) poses.push_back(view.model_from_scan);
  return poses;
}

}  // namespace asbuilt::test
