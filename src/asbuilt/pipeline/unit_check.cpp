// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/unit_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/detect/detect.h"

namespace asbuilt::pipeline {
namespace {

constexpr double kSmallestExtent = 0.05;    // of the diameter
constexpr double kFewestPoints = 50.0;      // on the part
constexpr double kPlausibleSmallest = 0.3;  // scan extent / diameter; a close-up is a tenth, but then seldom detected
constexpr double kPlausibleLargest = 30.0;  // a hall is ten times its part
constexpr std::array<double, 6> kFactors{1000.0, 0.001, 10.0, 0.1, 25.4, 1.0 / 25.4};

double extent_of(const std::vector<Eigen::Vector3f>& points) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& point : points) {
    if (point.allFinite()) box.extend(point);
  }
  return box.isEmpty() ? 0.0 : static_cast<double>(box.diagonal().norm());
}

std::optional<io::Unit> unit_of(double millimetres) {
  for (const io::Unit unit :
       {io::Unit::millimetre, io::Unit::centimetre, io::Unit::metre, io::Unit::inch, io::Unit::foot}) {
    if (std::abs(io::millimetres_per(unit) / millimetres - 1.0) < 1e-6) return unit;
  }
  return std::nullopt;
}

std::string advice(double extent_mm, double diameter_mm, const Options& options) {
  const std::vector<double> factors = plausible_factors(extent_mm, diameter_mm);
  if (factors.empty()) return "check --unit and --scan-unit, and that this is the right model";
  return fmt::format("try {}", flag_for_factor(factors.front(), options));
}

}  // namespace

std::vector<double> plausible_factors(double scan_extent_mm, double diameter_mm) {
  std::vector<double> factors;
  for (const double factor : kFactors) {
    const double ratio = factor * scan_extent_mm / diameter_mm;
    if (kPlausibleSmallest <= ratio && ratio <= kPlausibleLargest) factors.push_back(factor);
  }
  return factors;
}

std::string flag_for_factor(double factor, const Options& options, const std::string& scan) {
  if (const auto unit = unit_of(factor * io::millimetres_per(options.scan_unit))) {
    return fmt::format("--scan-unit {}{}", scan.empty() ? "" : scan + ":", io::name_of(*unit));
  }
  if (const auto unit = unit_of(io::millimetres_per(options.model_unit) / factor)) {
    return fmt::format("--unit {}", io::name_of(*unit));
  }
  return fmt::format("--unit or --scan-unit (the scan seems {:g} times too small)", factor);
}

std::optional<std::string> size_contradiction(const scan::Scan& scan, const model::PreparedModel& model,
                                              const Options& options) {
  const double extent = extent_of(scan.cloud.positions);
  if (extent < kSmallestExtent * model.diameter) {
    return fmt::format(
        "the scan is {:.3g} mm wide and the part {:.3g} mm: at most a twentieth of it can be in view; {}", extent,
        model.diameter, advice(extent, model.diameter, options));
  }
  // At most half of the surface faces the sensor.
  const double points_on_part = 0.5 * surface_area(model.skin) / (scan.spacing_mm * scan.spacing_mm);
  if (points_on_part >= kFewestPoints) return std::nullopt;
  return fmt::format(
      "the scan's points lie {:.3g} mm apart and the part is {:.3g} mm wide: at most {:.0f} points can "
      "fall on it, {:.0f} are needed; {}",
      scan.spacing_mm, model.diameter, points_on_part, kFewestPoints, advice(extent, model.diameter, options));
}

std::optional<double> factor_that_finds_the_part(const io::ScanFile& file, const model::PreparedModel& model,
                                                 const detect::Codebook& codebook, const Options& options,
                                                 const Context& context) {
  for (const double factor : plausible_factors(extent_of(file.cloud.positions), model.diameter)) {
    PointCloud scaled;
    for (const Eigen::Vector3f& position : file.cloud.positions) {
      if (position.allFinite()) scaled.positions.push_back(static_cast<float>(factor) * position);
    }
    PointCloud thin;  // half a sampling distance is what detection looks at; more would only take time
    for (const std::uint32_t i : even_subset(scaled.positions, 0.25 * model.sampling_distance, context)) {
      thin.positions.push_back(scaled.positions[i]);
    }
    const auto prepared = scan::prepare_scan(thin, std::nullopt, {}, options.scan, context);
    if (!prepared || size_contradiction(*prepared, model, options)) continue;
    const auto hypotheses = detect::find_hypotheses(*prepared, codebook, options.detect, context);
    if (!hypotheses) continue;
    const auto detection = verify::verify(*prepared, model, *hypotheses, options.verify, context);
    if (detection && detection->status != verify::Status::rejected) return factor;
  }
  return std::nullopt;
}

}  // namespace asbuilt::pipeline
