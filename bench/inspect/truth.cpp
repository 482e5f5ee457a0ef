// SPDX-License-Identifier: Apache-2.0
#include "truth.h"

#include <cmath>

namespace asbuilt::bench {
namespace {

constexpr double kCosLimit = 0.2419;  // 76 degrees

}  // namespace

InspectionTruth::InspectionTruth(const simulate::Simulation& simulation)
    : as_built_(simulation.as_built), reach_mm_(0.02 * diameter(simulation.model)) {
  for (const simulate::SimulatedScan& scan : simulation.scans) {
    if (scan.model_from_scan) sensors_in_model_.emplace_back(scan.model_from_scan->translation());
  }
}

bool InspectionTruth::is_visible(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const {
  const Eigen::Vector3d point = position + deviation(position, normal).value_or(0.0) * normal;
  for (const Eigen::Vector3d& sensor : sensors_in_model_) {
    const Eigen::Vector3d way = sensor - point;
    const double distance = way.norm();
    if (way.dot(normal) < kCosLimit * distance) continue;
    if (!as_built_.is_blocked(point, way / distance, 1e-3 * reach_mm_, distance)) return true;
  }
  return false;
}

std::optional<double> InspectionTruth::deviation(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const {
  // The two hits about the place; the nearer one is its surface.
  std::optional<double> nearest;
  for (const double side : {1.0, -1.0}) {
    const auto hit = as_built_.first_hit(position, side * normal, 0.0, reach_mm_);
    if (!hit.found()) continue;
    if (!nearest || hit.distance < std::abs(*nearest)) nearest = side * hit.distance;
  }
  return nearest;
}

}  // namespace asbuilt::bench
