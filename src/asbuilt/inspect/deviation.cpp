// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/deviation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::inspect {
namespace {

constexpr std::size_t kGrain = 1024;
constexpr float kSameSideCosine = 0.5F;  // foot and sample lie on faces turned by less than 60 degrees

/// Where a point of the cloud meets the surface.
struct Foot {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d face_normal = Eigen::Vector3d::Zero();
  double deviation_mm = 0.0;
};

Eigen::Vector3d face_normal(const TriangleMesh& mesh, std::uint32_t triangle) {
  return doubled_area_vector(mesh, triangle).normalized();
}

Result<std::vector<Foot>> feet_of(const PointCloud& cloud, const model::PreparedModel& model, const Context& context) {
  std::vector<Foot> feet(cloud.size());
  parallel_for(context, cloud.size(), kGrain, [&](std::size_t i) {
    if (context.cancelled()) return;
    const auto nearest = model.surface->nearest(cloud.positions[i].cast<double>());
    feet[i] = {nearest.point, face_normal(model.skin, nearest.triangle), nearest.signed_distance};
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "the inspection was interrupted");
  return feet;
}

/// The feet that may speak for the surface around them, as a searchable cloud.
struct Witnesses {
  std::vector<Eigen::Vector3f> positions, face_normals;
  std::vector<double> deviation_mm;
};

Witnesses witnesses_of(const PointCloud& cloud, const std::vector<Foot>& feet, double max_distance_mm) {
  Witnesses witnesses;
  for (std::size_t i = 0; i < feet.size(); ++i) {
    if (std::abs(feet[i].deviation_mm) > max_distance_mm) continue;
    // The other wall of a thin sheet can be nearer; a point's own normal tells which wall it was measured on.
    if (cloud.has_normals() && cloud.normals[i].cast<double>().dot(feet[i].face_normal) < 0.0) continue;
    witnesses.positions.push_back(feet[i].point.cast<float>());
    witnesses.face_normals.push_back(feet[i].face_normal.cast<float>());
    witnesses.deviation_mm.push_back(feet[i].deviation_mm);
  }
  return witnesses;
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// One deviation per sample of the skin that was scanned, in the samples' order.
std::vector<double> deviations_over_area(const Witnesses& witnesses, const PointCloud& samples, double radius_mm,
                                         const Context& context) {
  const KdTree tree(witnesses.positions);
  std::vector<std::optional<double>> of_sample(samples.size());
  parallel_for_blocks(context, samples.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> nearby;
    std::vector<double> values;
    for (std::size_t i = begin; i < end && !context.cancelled(); ++i) {
      tree.within(samples.positions[i], static_cast<float>(radius_mm), nearby);
      values.clear();
      for (const KdTree::Neighbour& neighbour : nearby) {
        const bool same_side = witnesses.face_normals[neighbour.index].dot(samples.normals[i]) > kSameSideCosine;
        if (same_side) values.push_back(witnesses.deviation_mm[neighbour.index]);
      }
      if (!values.empty()) of_sample[i] = median(values);
    }
  });
  std::vector<double> deviations;
  for (const auto& deviation : of_sample) {
    if (deviation) deviations.push_back(*deviation);
  }
  return deviations;
}

}  // namespace

Result<void> InspectOptions::validate() const {
  if (!(max_distance_ratio > 0.0 && std::isfinite(max_distance_ratio))) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("max_distance_ratio is {}, expected a share of the diameter above 0", max_distance_ratio));
  }
  if (!(required_share >= 0.0 && required_share <= 1.0)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("required_share is {}, expected a share in [0, 1]", required_share));
  }
  if (!tolerance) return {};
  const bool finite = std::isfinite(tolerance->low_mm) && std::isfinite(tolerance->high_mm);
  if (finite && tolerance->low_mm <= tolerance->high_mm) return {};
  return fail(ErrorCode::invalid_argument, fmt::format("the tolerance is {},{} mm, expected LOW,HIGH with LOW <= HIGH",
                                                       tolerance->low_mm, tolerance->high_mm));
}

std::optional<bool> DeviationReport::within_tolerance(const InspectOptions& options) const {
  if (!options.tolerance) return std::nullopt;
  return over_area.in_tolerance.value_or(0.0) >= options.required_share;
}

Result<DeviationReport> inspect(const PointCloud& cloud_in_model, const model::PreparedModel& model,
                                const InspectOptions& options, const Context& context) {
  ASBUILT_CHECK(options.validate());
  if (model.dense_samples.empty()) return fail(ErrorCode::not_possible, "the model has no surface to measure against");
  ASBUILT_TRY(feet, feet_of(cloud_in_model, model, context));

  DeviationReport report;
  const double max_distance_mm = options.max_distance_ratio * model.diameter;
  std::vector<double> counted;
  for (const Foot& foot : feet) {
    report.deviation_mm.push_back(static_cast<float>(foot.deviation_mm));
    if (std::abs(foot.deviation_mm) <= max_distance_mm) counted.push_back(foot.deviation_mm);
  }
  report.far_points = feet.size() - counted.size();
  report.over_points = statistics(std::move(counted), options.tolerance);

  const Witnesses witnesses = witnesses_of(cloud_in_model, feet, max_distance_mm);
  if (witnesses.positions.empty()) return report;
  const double radius_mm =
      std::max(median_spacing(model.dense_samples.positions), 1.5 * median_spacing(cloud_in_model.positions));
  std::vector<double> over_area = deviations_over_area(witnesses, model.dense_samples, radius_mm, context);
  if (context.cancelled()) return fail(ErrorCode::cancelled, "the inspection was interrupted");
  report.coverage = static_cast<double>(over_area.size()) / static_cast<double>(model.dense_samples.size());
  report.over_area = statistics(std::move(over_area), options.tolerance);
  context.report_progress(1.0);
  return report;
}

}  // namespace asbuilt::inspect
