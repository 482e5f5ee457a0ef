// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/inspect/alignment.h"
#include "asbuilt/inspect/faces.h"
#include "asbuilt/inspect/measurement.h"
#include "asbuilt/inspect/reference.h"
#include "asbuilt/inspect/regions.h"
#include "asbuilt/inspect/spots.h"
#include "asbuilt/inspect/statistics.h"
#include "asbuilt/inspect/tolerance.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::inspect {

struct InspectOptions {
  double max_distance_ratio = 0.05;  ///< points further than this share of the diameter are not the part's (our value)
  double required_share = 0.99;      ///< share of the scanned surface that must lie within the tolerance (our value)
  double minimum_coverage = 0.5;     ///< less of a face or part scanned is not enough data (our value)
  double significance = 3.0;         ///< standard errors from which a deviation is not noise (99.7 %)
  double reference_distance_mm =
      0.0;  ///< how far about a check point the surface is looked for; 0: 1 % of the diameter

  std::optional<Tolerance> tolerance;  ///< of all faces that no row of `tolerances` names
  ToleranceTable tolerances = {};      ///< one per CAD face or box
  AlignmentOptions alignment = {};
  std::vector<ReferencePoint> reference = {};  ///< check points

  [[nodiscard]] bool has_tolerance() const {
    return tolerance.has_value() || tolerances.others.has_value() || !tolerances.rows.empty();
  }
  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(InspectOptions& options, Visitor&& field) {
  field("max_distance_ratio", options.max_distance_ratio, "distance / diameter beyond which a point is not the part's");
  field("required_share", options.required_share, "share of the scanned surface that the tolerance must hold");
  field("minimum_coverage", options.minimum_coverage, "share of a face or part below which it is not enough data");
  field("significance", options.significance, "standard errors from which a deviation is not noise");
  field("reference_distance", options.reference_distance_mm,
        "how far about a check point the surface is looked for, mm (0: 1 % of the diameter)");
}

struct DeviationReport {
  std::vector<float> deviation_mm;  ///< one per point of the cloud; positive: outside the material
  std::size_t far_points = 0;       ///< beyond max_distance_ratio; in no statistic
  std::size_t on_open_edges = 0;    ///< points nearest to the border of an open model: their sign means nothing
  Alignment alignment;              ///< applied before anything was measured
  DeviationStatistics over_points;
  DeviationStatistics over_area;  ///< over even samples of the CAD surface that were scanned
  double coverage = 0.0;          ///< share of the CAD surface that was scanned
  double area_mm2 = 0.0;          ///< of the CAD surface
  double noise_sigma_mm = 0.0;    ///< of a single point, from the scatter of neighbours; 0: unknown
  double spacing_mm = 0.0;        ///< of the cloud, median

  std::vector<Spot> spots;                   ///< one per dense sample of the model
  std::vector<std::uint32_t> face_of_spot;   ///< index into `faces`
  std::vector<std::int32_t> region_of_spot;  ///< index into `regions`, -1: none
  FaceMap face_map;
  std::vector<SurfacePart> faces, boxes;
  std::vector<Eigen::AlignedBox3d> box_extents;  ///< of `boxes`, model frame
  std::vector<Region> regions;                   ///< the largest of them
  std::size_t regions_found = 0;                 ///< all of them
  Tolerance region_limits;                       ///< what regions exceed where there is no tolerance
  double significant_share = 0.0;                ///< of the scanned area: deviations that are not noise
  std::optional<ReferenceReport> reference;
  std::optional<Verdict> verdict;            ///< absent without a tolerance
  std::shared_ptr<const SpotFinder> finder;  ///< answers what was measured at other places, by the same rules

  /// What holds at a place of a face: that of the box it lies in, of its face, or of all others; null: nothing.
  [[nodiscard]] const Tolerance* tolerance_at(std::uint32_t face, const Eigen::Vector3f& position) const;
};

/// How far a cloud lies from the CAD surface.
///
/// A point's deviation is the exact signed distance to the nearest triangle, whatever the point's normal. For the
/// figures over area, each even sample of the skin takes the mean deviation of the points about it on its own side
/// (SpotFinder); a sample without such points was not scanned.
///
/// Errors: invalid_argument for bad options, not_possible for a model without samples or an alignment without points,
/// cancelled.
[[nodiscard]] Result<DeviationReport> inspect(const Measurement& measurement, const model::PreparedModel& model,
                                              const InspectOptions& options, const Context& context);
[[nodiscard]] Result<DeviationReport> inspect(const PointCloud& cloud_in_model, const model::PreparedModel& model,
                                              const InspectOptions& options, const Context& context);

}  // namespace asbuilt::inspect
