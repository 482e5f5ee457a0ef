// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::inspect {

/// Deviations that the drawing allows, both ends included.
struct Tolerance {
  double low_mm = 0.0, high_mm = 0.0;
};

struct InspectOptions {
  double max_distance_ratio = 0.05;  ///< points further than this share of the diameter are not the part's (our value)
  double required_share = 0.99;      ///< share of the scanned surface that must lie within the tolerance (our value)
  std::optional<Tolerance> tolerance;

  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(InspectOptions& options, Visitor&& field) {
  field("max_distance_ratio", options.max_distance_ratio, "distance / diameter beyond which a point is not the part's");
  field("required_share", options.required_share, "share of the scanned surface that the tolerance must hold");
}

/// Statistics of signed deviations (users.md, section 2), mm. All zero when count is.
struct DeviationStatistics {
  std::size_t count = 0;
  double min = 0, max = 0, mean = 0, mean_absolute = 0, rms = 0;
  double sigma = 0;                             ///< standard deviation about the mean
  double mean_positive = 0, mean_negative = 0;  ///< of the deviations > 0 and < 0; 0 when there are none
  double median = 0, p95 = 0, p99 = 0;          ///< p95, p99 of absolute deviations
  std::optional<double> in_tolerance, over_tolerance, under_tolerance;  ///< shares, when a tolerance is given
};

/// Quantiles are of the sorted values with linear interpolation between ranks. Values must be finite.
[[nodiscard]] DeviationStatistics statistics(std::vector<double> deviations_mm,
                                             const std::optional<Tolerance>& tolerance);

struct DeviationReport {
  std::vector<float> deviation_mm;  ///< one per point of the cloud; positive: outside the material
  std::size_t far_points = 0;       ///< beyond max_distance_ratio; in no statistic
  DeviationStatistics over_points;
  DeviationStatistics over_area;  ///< over even samples of the CAD surface that were scanned
  double coverage = 0.0;          ///< share of the CAD surface that was scanned

  /// Whether the tolerance holds on the required share of the scanned surface; nothing without a tolerance, and false
  /// when nothing was scanned.
  [[nodiscard]] std::optional<bool> within_tolerance(const InspectOptions& options) const;
};

/// How far a cloud lies from the CAD surface.
///
/// A point's deviation is the exact signed distance to the nearest triangle, whatever the point's normal. For the
/// figures over area, each even sample of the skin takes the median deviation of the points whose nearest surface point
/// lies next to it on its own side (their own normals, if there are any, must agree); a sample without such points was
/// not scanned. "Next to" is one sample spacing, or one and a half point spacings where the cloud is coarser.
///
/// Errors: invalid_argument for bad options, not_possible for a model without samples.
[[nodiscard]] Result<DeviationReport> inspect(const PointCloud& cloud_in_model, const model::PreparedModel& model,
                                              const InspectOptions& options, const Context& context);

}  // namespace asbuilt::inspect
