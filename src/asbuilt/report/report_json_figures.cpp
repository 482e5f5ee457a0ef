// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "asbuilt/core/median.h"
#include "asbuilt/io/json_text.h"
#include "asbuilt/report/report_json.h"

namespace asbuilt::report {

using io::json_number;

namespace {

Json colour_json(const Rgb& rgb) { return {rgb[0], rgb[1], rgb[2]}; }

}  // namespace

Json optional_number(const std::optional<double>& value) { return value ? json_number(*value) : Json(nullptr); }
Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }
Json triple(const Eigen::Vector3d& v) { return {json_number(v.x()), json_number(v.y()), json_number(v.z())}; }

Json pose_json(const Pose& pose) {
  Json numbers = Json::array();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) numbers.push_back(json_number(pose.matrix()(row, column)));
  }
  return numbers;
}

Json tolerance_json(const std::optional<inspect::Tolerance>& tolerance) {
  return tolerance ? Json{json_number(tolerance->low_mm), json_number(tolerance->high_mm)} : Json(nullptr);
}

Json statistics_json(const inspect::DeviationStatistics& s) {
  const auto known = [&](double value) { return s.count > 0 ? json_number(value) : Json(nullptr); };
  return {{"count", s.count},
          {"min", known(s.min)},
          {"max", known(s.max)},
          {"mean", known(s.mean)},
          {"mean_absolute", known(s.mean_absolute)},
          {"rms", known(s.rms)},
          {"sigma", known(s.sigma)},
          {"sigma_without_noise", optional_number(s.sigma_without_noise)},
          {"mean_positive", known(s.mean_positive)},
          {"mean_negative", known(s.mean_negative)},
          {"median", known(s.median)},
          {"p95", known(s.p95)},
          {"p99", known(s.p99)},
          {"in_tolerance", optional_number(s.in_tolerance)},
          {"over_tolerance", optional_number(s.over_tolerance)},
          {"under_tolerance", optional_number(s.under_tolerance)}};
}

Json coverage_json(const inspect::DeviationReport& deviations) {
  std::size_t scanned = 0, support = 0;
  for (const inspect::Spot& spot : deviations.spots) {
    scanned += spot.is_scanned() ? 1 : 0;
    support += spot.scans;
  }
  return {{"share", json_number(deviations.coverage)},
          {"area", json_number(deviations.coverage * deviations.area_mm2)},
          {"spots", deviations.spots.size()},
          {"spots_scanned", scanned},
          {"support_mean",
           scanned > 0 ? json_number(static_cast<double>(support) / static_cast<double>(scanned)) : Json(nullptr)}};
}

Json significance_json(const ReportInput& input) {
  std::vector<double> errors;
  for (const inspect::Spot& spot : input.deviations.spots) {
    if (std::isfinite(spot.standard_error_mm)) errors.push_back(static_cast<double>(spot.standard_error_mm));
  }
  const Json middle = errors.empty() ? Json(nullptr) : json_number(median_of(std::move(errors)));
  // Two-sided, of a normal error.
  const double confidence = std::erf(input.options.significance / std::sqrt(2.0));
  return {{"confidence", json_number(confidence)},
          {"standard_errors", json_number(input.options.significance)},
          {"significant_share", errors.empty() ? Json(nullptr) : json_number(input.deviations.significant_share)},
          {"standard_error_median", middle}};
}

Json histogram_json(const inspect::DeviationReport& deviations, double range) {
  constexpr int kBins = 60;
  std::vector<std::size_t> counts(kBins, 0);
  std::size_t below = 0, above = 0;
  for (const inspect::Spot& spot : deviations.spots) {
    if (!spot.is_scanned()) continue;
    const double place = (static_cast<double>(spot.deviation_mm) / range + 1.0) * 0.5 * kBins;
    if (place < 0.0) {
      ++below;
    } else if (place >= kBins + 1e-9) {
      ++above;
    } else {
      ++counts[std::min<std::size_t>(static_cast<std::size_t>(place), kBins - 1)];
    }
  }
  return {{"low", json_number(-range)},
          {"high", json_number(range)},
          {"bins", kBins},
          {"over_area", counts},
          {"below", below},
          {"above", above}};
}

Json colours_json(const ColourMap& colours) {
  Json stops = Json::array(), steps = Json::array();
  for (const ColourMap::Stop& stop : colours.stops()) {
    stops.push_back({{"value", json_number(stop.value_mm)}, {"rgb", colour_json(stop.rgb)}});
  }
  for (const ColourMap::Step& step : colours.steps()) {
    steps.push_back(
        {{"from", json_number(step.from_mm)}, {"to", json_number(step.to_mm)}, {"rgb", colour_json(step.rgb)}});
  }
  const auto& tolerance = colours.tolerance();
  return {{"low", json_number(-colours.range_mm())},
          {"high", json_number(colours.range_mm())},
          {"tolerance_low", tolerance ? json_number(tolerance->low_mm) : Json(nullptr)},
          {"tolerance_high", tolerance ? json_number(tolerance->high_mm) : Json(nullptr)},
          {"not_scanned", colour_json(ColourMap::kNotScanned)},
          {"stops", stops},
          {"steps", steps}};
}

}  // namespace asbuilt::report
