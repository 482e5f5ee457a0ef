// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/model/ray_scene.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/simulate/simulate.h"

namespace asbuilt::bench {

/// What a perfect inspection would say at places of the CAD surface.
class InspectionTruth {
 public:
  explicit InspectionTruth(const simulate::Simulation& simulation);

  /// Whether any scan could see the place: it faces the sensor by less than the angle at which the last returns fade
  /// (NoiseModel::grazing_deg) and nothing of the part stands between.
  [[nodiscard]] bool is_visible(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const;

  /// Distance of the true surface from a place of the CAD, positive outside; nothing beyond 2 % of the diameter.
  [[nodiscard]] std::optional<double> deviation(const Eigen::Vector3d& position) const;

 private:
  model::RayScene rays_;
  model::SurfaceDistance surface_;
  double reach_mm_;
  std::vector<Eigen::Vector3d> sensors_in_model_;
};

}  // namespace asbuilt::bench
