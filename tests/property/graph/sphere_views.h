// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "asbuilt/core/random.h"
#include "asbuilt/graph/pose_graph.h"

namespace asbuilt::test {

inline constexpr double kSphereRadius = 50.0;

inline PointCloud sphere_points(int count) {
  PointCloud cloud;  // Fibonacci lattice: even without any randomness
  const double golden = 3.14159265358979 * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count, r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d d(r * std::cos(golden * i), r * std::sin(golden * i), z);
    cloud.positions.push_back((kSphereRadius * d).cast<float>());
    cloud.normals.push_back(d.cast<float>());
  }
  return cloud;
}

/// A model without a mesh: what the graph uses of it are the samples and the diameter.
inline model::PreparedModel sphere_model() {
  model::PreparedModel model;
  model.dense_samples = sphere_points(20000);
  model.diameter = 2.0 * kSphereRadius * std::sqrt(3.0);
  return model;
}

/// The cap of the sphere within `half_angle` of `direction`, in a scan frame of its own.
inline graph::PosedSegment cap(const Eigen::Vector3d& direction, double half_angle, const Pose& model_from_scan,
                               int density = 20000) {
  graph::PosedSegment segment;
  segment.model_from_scan = model_from_scan;
  const PointCloud sphere = sphere_points(density);
  const Pose scan_from_model = model_from_scan.inverse();
  for (std::size_t i = 0; i < sphere.size(); ++i) {
    if (sphere.normals[i].cast<double>().dot(direction) < std::cos(half_angle)) continue;
    segment.segment_in_scan.positions.push_back((scan_from_model * sphere.positions[i].cast<double>()).cast<float>());
    segment.segment_in_scan.normals.push_back(
        (scan_from_model.linear() * sphere.normals[i].cast<double>()).cast<float>());
  }
  return segment;
}

inline graph::PosedSegment random_cap(Random& random) {
  const Eigen::Vector3d direction = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
  Vector6d twist;
  for (int i = 0; i < 3; ++i) twist[i] = random.normal();
  for (int i = 3; i < 6; ++i) twist[i] = 200.0 * random.normal();
  return cap(direction, random.uniform(0.4, 1.0), pose_from_twist(twist));
}

}  // namespace asbuilt::test
