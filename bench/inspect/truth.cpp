// SPDX-License-Identifier: Apache-2.0
#include "truth.h"

#include <cmath>
#include <numbers>

#include "asbuilt/simulate/scanner.h"

namespace asbuilt::bench {
namespace {

// Beyond the angle at which the virtual scanner gets no returns at all a place cannot be scanned.
const double kCosLimit = std::cos(simulate::NoiseModel{}.grazing_deg * std::numbers::pi / 180.0);

TriangleMesh moved(TriangleMesh mesh, const Pose& motion) {
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex = motion * vertex;
  return mesh;
}

}  // namespace

InspectionTruth::InspectionTruth(const simulate::Simulation& simulation, const Pose& aligned_from_true)
    : InspectionTruth(simulation, moved(simulation.as_built, aligned_from_true), aligned_from_true) {}

InspectionTruth::InspectionTruth(const simulate::Simulation& simulation, const TriangleMesh& as_built,
                                 const Pose& aligned_from_true)
    : rays_(as_built),
      surface_(as_built),
      cad_(simulation.model),
      true_vertices_(as_built.vertices),
      reach_mm_(0.02 * diameter(simulation.model)) {
  for (const simulate::SimulatedScan& scan : simulation.scans) {
    if (scan.model_from_scan) sensors_in_model_.emplace_back(aligned_from_true * scan.model_from_scan->translation());
  }
}

bool InspectionTruth::is_visible(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const {
  // Lifted off the true surface by a thousandth of the diameter, so that its own facets do not stand in the way.
  const Eigen::Vector3d point = position + (deviation(position).value_or(0.0) + 0.05 * reach_mm_) * normal;
  for (const Eigen::Vector3d& sensor : sensors_in_model_) {
    const Eigen::Vector3d way = sensor - point;
    const double distance = way.norm();
    if (way.dot(normal) < kCosLimit * distance) continue;
    if (!rays_.is_blocked(point, way / distance, 0.0, distance)) return true;
  }
  return false;
}

std::optional<double> InspectionTruth::peak(const simulate::Bump& bump,
                                            const std::function<bool(const Eigen::Vector3d& place)>& is_scanned) const {
  std::optional<double> furthest;
  for (const Eigen::Vector3d& vertex : true_vertices_) {
    if ((vertex - bump.centre_in_model).norm() > bump.radius_mm) continue;
    const auto foot = cad_.nearest(vertex, reach_mm_);
    if (!foot.found() || foot.signed_distance * bump.height_mm <= 0.0) continue;
    if (furthest && std::abs(foot.signed_distance) <= std::abs(*furthest)) continue;
    if (is_scanned(foot.point)) furthest = foot.signed_distance;
  }
  return furthest;
}

std::optional<double> InspectionTruth::deviation(const Eigen::Vector3d& position) const {
  const auto nearest = surface_.nearest(position, reach_mm_);
  if (!nearest.found() || nearest.on_open_edge) return std::nullopt;
  return -nearest.signed_distance;  // a place of the CAD outside of the true part: the part is too low there
}

}  // namespace asbuilt::bench
