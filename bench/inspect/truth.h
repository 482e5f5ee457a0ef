// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/model/ray_scene.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/simulate/as_built.h"
#include "asbuilt/simulate/simulate.h"

namespace asbuilt::bench {

/// What a perfect inspection would say at places of the CAD surface.
class InspectionTruth {
 public:
  /// The true part is held against the CAD where `aligned_from_true` puts it: a deviation is one in an alignment.
  InspectionTruth(const simulate::Simulation& simulation, const Pose& aligned_from_true);

  /// Whether any scan could see the place: it faces the sensor by less than the angle at which the last returns fade
  /// (NoiseModel::grazing_deg) and nothing of the part stands between.
  [[nodiscard]] bool is_visible(const Eigen::Vector3d& position, const Eigen::Vector3d& normal) const;

  /// The true extremum about a bump, towards its own side: the furthest vertex of the true part off the CAD, where
  /// `is_scanned` says of the CAD's place under it that something was scanned. Nothing where nothing was.
  [[nodiscard]] std::optional<double> peak(const simulate::Bump& bump,
                                           const std::function<bool(const Eigen::Vector3d& place)>& is_scanned) const;

  /// Distance of the true surface from a place of the CAD, positive outside; nothing beyond 2 % of the diameter.
  [[nodiscard]] std::optional<double> deviation(const Eigen::Vector3d& position) const;

 private:
  InspectionTruth(const simulate::Simulation& simulation, const TriangleMesh& as_built, const Pose& aligned_from_true);

  model::RayScene rays_;
  model::SurfaceDistance surface_, cad_;
  std::vector<Eigen::Vector3d> true_vertices_;  // fine about the bumps
  double reach_mm_;
  std::vector<Eigen::Vector3d> sensors_in_model_;
};

}  // namespace asbuilt::bench
