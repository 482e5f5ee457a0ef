// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/visibility.h"

namespace asbuilt::simulate {
namespace {

// The last bit of the way is left out, so that a sample is not blocked by the very face it lies on.
bool is_covered(const Eigen::Vector3d& point, const model::RayScene& rays, const Eigen::Vector3d& eye) {
  const double range = (point - eye).norm();
  return rays.is_blocked(eye, (point - eye) / range, 0.0, range * (1.0 - 1e-5) - 0.02);
}

}  // namespace

std::vector<std::size_t> visible_samples(std::span<const SurfacePoint> samples_in_world, const model::RayScene& rays,
                                         const Sensor& sensor) {
  const Eigen::Vector3d eye = sensor.position_in_world();
  std::vector<std::size_t> visible;
  for (std::size_t i = 0; i < samples_in_world.size(); ++i) {
    const SurfacePoint& sample = samples_in_world[i];
    if (sample.normal.dot(eye - sample.position) <= 0.0 || !sensor.has_in_view(sample.position)) continue;
    if (!is_covered(sample.position, rays, eye)) visible.push_back(i);
  }
  return visible;
}

std::vector<std::size_t> covered_samples(std::span<const SurfacePoint> samples_in_world,
                                         std::span<const std::size_t> candidates, const model::RayScene& rays,
                                         const Sensor& sensor) {
  const Eigen::Vector3d eye = sensor.position_in_world();
  std::vector<std::size_t> covered;
  for (const std::size_t i : candidates) {
    if (is_covered(samples_in_world[i].position, rays, eye)) covered.push_back(i);
  }
  return covered;
}

}  // namespace asbuilt::simulate
