// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <numbers>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/random.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"
#include "support/parts.h"

namespace asbuilt::test {

struct OrientedPoint {
  Eigen::Vector3f position, normal;
};

inline Eigen::Vector3d random_vector_double(Random& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size), z = random.uniform(-size, size);
  return {x, y, z};
}

inline Eigen::Vector3f random_vector(Random& random, double size) {
  return random_vector_double(random, size).cast<float>();
}

inline OrientedPoint random_oriented_point(Random& random, double size = 100.0) {
  const Eigen::Vector3f position = random_vector(random, size);
  return {position, random_vector(random, 1.0).normalized()};
}

inline Pose random_pose(Random& random, double size = 300.0) {
  Pose pose = Pose::Identity();
  const Eigen::Vector3d axis = random_vector_double(random, 1.0).normalized();
  pose.linear() = Eigen::AngleAxisd(random.uniform(0.0, std::numbers::pi), axis).toRotationMatrix();
  pose.translation() = random_vector_double(random, size);
  return pose;
}

inline OrientedPoint moved(const Pose& pose, const OrientedPoint& point) {
  return {(pose * point.position.cast<double>()).cast<float>(),
          (pose.linear() * point.normal.cast<double>()).cast<float>().normalized()};
}

/// A coarse model that is quick to pair: some hundred samples.
inline model::PreparedModel small_model(double sampling_ratio = 0.05) {
  model::ModelOptions options;
  options.sampling_ratio = sampling_ratio;
  return model::prepare(stepped_block(), options, Context(2)).value();
}

/// The model's own dense samples as a scan without viewpoint, moved into the scan frame.
inline scan::Scan scan_of(const PointCloud& samples_in_model, const Pose& scan_from_model, double spacing_mm) {
  scan::Scan scan;
  for (std::size_t i = 0; i < samples_in_model.size(); ++i) {
    const OrientedPoint point = moved(scan_from_model, {samples_in_model.positions[i], samples_in_model.normals[i]});
    scan.cloud.positions.push_back(point.position);
    scan.cloud.normals.push_back(point.normal);
  }
  scan.surface_variation.assign(scan.cloud.size(), 0.0F);
  scan.normals_oriented = true;
  scan.spacing_mm = spacing_mm;
  return scan;
}

}  // namespace asbuilt::test
