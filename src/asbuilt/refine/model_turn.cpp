// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/model_turn.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/refine/sampled_view.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kPoints = 6000;
constexpr double kStepRatio = 0.003;     // of the diameter, at the outermost point
constexpr int kFewestSteps = 24;         // to know by how much turns differ
constexpr int kSamePlace = 4;            // steps: a peak is that wide
constexpr double kFarInScales = 3.0;     // further off is off, by how much does not matter
constexpr double kReachRatio = 0.05;     // of the diameter
constexpr double kDecisiveLead = 2.5;    // robust standard deviations of the costs of all turns
constexpr double kToDeviation = 1.4826;  // of a median of absolute values

class Turns {
 public:
  Turns(const View& view, const model::SurfaceDistance& surface, double diameter_mm, const TurnAxis& axis,
        const Context& context)
      : surface_(surface), axis_(axis), reach_(kReachRatio * diameter_mm) {
    double radius = 0.0;
    for (const Eigen::Vector3f& position : evenly_sampled(view.segment_in_scan, kPoints, context).positions) {
      points_.emplace_back(view.model_from_scan * position.cast<double>());
      radius = std::max(radius, axis.direction.cross(points_.back() - axis.point).norm());
    }
    const double arc = axis.period_rad * radius;
    steps_ = std::max(kFewestSteps, static_cast<int>(std::ceil(arc / (kStepRatio * diameter_mm))));
  }

  [[nodiscard]] int steps() const { return steps_; }
  [[nodiscard]] double angle(int step) const { return axis_.period_rad * step / steps_; }

  // Distances of the points, turned, from the CAD.
  [[nodiscard]] std::vector<double> distances(int step) const {
    const Eigen::AngleAxisd rotation(angle(step), axis_.direction);
    std::vector<double> distances;
    distances.reserve(points_.size());
    for (const Eigen::Vector3d& point : points_) {
      const auto nearest = surface_.nearest(rotation * (point - axis_.point) + axis_.point, reach_);
      distances.push_back(nearest.found() ? std::abs(nearest.signed_distance) : reach_);
    }
    return distances;
  }

 private:
  const model::SurfaceDistance& surface_;
  const TurnAxis& axis_;
  double reach_;
  std::vector<Eigen::Vector3d> points_;
  int steps_ = 0;
};

Result<void> check(const View& view, double diameter_mm, const TurnAxis& axis) {
  if (view.segment_in_scan.normals.size() != view.segment_in_scan.size()) {
    return fail(ErrorCode::invalid_argument, "the view has not one normal a point");
  }
  if (!(diameter_mm > 0.0 && std::isfinite(diameter_mm)) || !(axis.period_rad > 0.0)) {
    return fail(ErrorCode::invalid_argument, "a turn about an axis needs a diameter and a period");
  }
  return {};
}

}  // namespace

Result<ModelTurn> turn_on_model(const View& view, const model::SurfaceDistance& surface, double diameter_mm,
                                const TurnAxis& axis, const Context& context) {
  ASBUILT_CHECK(check(view, diameter_mm, axis));
  if (view.segment_in_scan.empty()) return ModelTurn{};
  const Turns turns(view, surface, diameter_mm, axis, context);
  const double far_mm = std::max(kFarInScales * kToDeviation * median_of(turns.distances(0)), 1e-9 * diameter_mm);
  std::vector<double> costs(static_cast<std::size_t>(turns.steps()), 0.0);
  parallel_for(context, costs.size(), 1, [&](std::size_t step) {
    if (context.cancelled()) return;
    for (const double distance : turns.distances(static_cast<int>(step))) {
      const double share = std::min(distance / far_mm, 1.0);
      costs[step] += share * share;
    }
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while the turns of a scan were compared");

  const auto best = static_cast<int>(std::ranges::min_element(costs) - costs.begin());
  const double usual = median_of(costs);
  std::vector<double> off(costs.size());
  std::ranges::transform(costs, off.begin(), [&](double cost) { return std::abs(cost - usual); });
  const double deviation = kToDeviation * median_of(std::move(off));
  double next = std::numeric_limits<double>::infinity();
  for (int step = 0; step < turns.steps(); ++step) {
    const int apart = std::abs(step - best);
    if (std::min(apart, turns.steps() - apart) > kSamePlace)
      next = std::min(next, costs[static_cast<std::size_t>(step)]);
  }
  return ModelTurn{turns.angle(best), next - costs[static_cast<std::size_t>(best)] > kDecisiveLead * deviation};
}

}  // namespace asbuilt::refine
