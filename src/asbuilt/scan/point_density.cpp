// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/point_density.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/robust.h"

namespace asbuilt::scan {
namespace {

using Position = Eigen::Vector3d;

constexpr double kDensityScale = 0.3;  // of ln(density): twice the scatter of a count of 40
constexpr double kLeastCosine = 0.05;  // flatter surfaces are hardly ever measured, and least regularly

// Points per area around one point, counted in its tangent plane; nothing next to an edge, where a part of the
// neighbourhood is empty, and where noise is as wide as the neighbourhood.
std::optional<double> log_density_at(std::span<const Eigen::Vector3f> points, const Eigen::Vector3f& point,
                                     const Eigen::Vector3f& normal, const KdTree& tree, double noise_sigma_mm,
                                     std::vector<KdTree::Neighbour>& neighbours) {
  constexpr std::size_t kNeighbours = 60, kFewest = 12;
  constexpr double kHeightInSigmas = 2.5, kMostOffCentre = 0.2, kMostWider = 3.0;
  tree.nearest(point, kNeighbours, neighbours);
  if (neighbours.size() < kNeighbours) return std::nullopt;
  double reach = std::sqrt(static_cast<double>(neighbours.back().squared_distance));
  const double height = kHeightInSigmas * noise_sigma_mm;
  if (kMostWider * reach < 1.5 * height) return std::nullopt;
  if (reach < 1.5 * height) {
    reach = 1.5 * height;
    tree.within(point, static_cast<float>(reach), neighbours);
  }
  // All neighbours in this circle are within reach, whatever their noise.
  const double squared_radius = reach * reach - height * height;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  std::size_t count = 0;
  for (const KdTree::Neighbour& neighbour : neighbours) {
    const Eigen::Vector3f away = points[neighbour.index] - point;
    const Eigen::Vector3f lateral = away - normal * normal.dot(away);
    if (lateral.squaredNorm() > squared_radius) continue;
    sum += lateral;
    ++count;
  }
  if (count < kFewest) return std::nullopt;
  const double off_centre = static_cast<double>(sum.norm()) / (static_cast<double>(count) * std::sqrt(squared_radius));
  if (off_centre > kMostOffCentre) return std::nullopt;
  // The point itself is one of those counted, and would be in an empty circle, too.
  return std::log(static_cast<double>(count - 1) / (std::numbers::pi * squared_radius));
}

constexpr std::array kAllSteps{PointDensity::Steps::angles, PointDensity::Steps::tangents,
                               PointDensity::Steps::turns_about_y, PointDensity::Steps::turns_about_z};

double rms_of(double robust_sum, std::size_t count) { return std::sqrt(robust_sum / static_cast<double>(count)); }

}  // namespace

// What a sensor at one place would measure.
class PointDensity::View {
 public:
  View(const Position& from, Steps steps, const Position& middle) : from_(from), steps_(steps) {
    if (steps == Steps::tangents) axis_ = (from - middle).normalized();
    if (steps == Steps::turns_about_y) axis_ = Eigen::Vector3d::UnitY();
    if (steps == Steps::turns_about_z) axis_ = Eigen::Vector3d::UnitZ();
  }

  /// ln(density) of a place, but for the rate. `gradient` by the position, the axis held.
  double predicted(const Place& place, Eigen::Vector3d* gradient = nullptr) const {
    const Eigen::Vector3d towards = from_ - place.point;
    const double squared_range = std::max(towards.squaredNorm(), 1e-12), range = std::sqrt(squared_range);
    const double along = place.normal.dot(towards);
    const bool is_flat = std::abs(along) < kLeastCosine * range;
    double log_w = 3.0 * std::log(range);
    Eigen::Vector3d slope_of_log_w = 3.0 / squared_range * towards;
    if (steps_ == Steps::tangents) {
      constexpr double kLeastDepth = 0.2;  // of the range: no picture is wider
      const double depth = towards.dot(axis_);
      const bool is_in_picture = depth > kLeastDepth * range;
      log_w = 3.0 * std::log(is_in_picture ? depth : kLeastDepth * range);
      if (is_in_picture) slope_of_log_w = 3.0 / depth * axis_;
    } else if (steps_ != Steps::angles) {
      constexpr double kLeastSine = 0.05;  // of the angle to the axis: at it there would be no end of points
      const Eigen::Vector3d aside = towards - towards.dot(axis_) * axis_;
      const bool is_aside = aside.norm() > kLeastSine * range;
      log_w = 2.0 * std::log(range) + std::log(is_aside ? aside.norm() : kLeastSine * range);
      if (is_aside) slope_of_log_w = 2.0 / squared_range * towards + aside / aside.squaredNorm();
    }
    if (gradient != nullptr) {
      *gradient = is_flat ? Eigen::Vector3d(towards / squared_range) : Eigen::Vector3d(place.normal / along);
      *gradient -= slope_of_log_w;
    }
    return std::log(is_flat ? kLeastCosine * range : std::abs(along)) - log_w;
  }

  double best_log_rate(std::span<const Place> places) const {
    std::vector<double> rates;
    rates.reserve(places.size());
    for (const Place& place : places) rates.push_back(place.log_density - predicted(place));
    return median_of(std::move(rates));
  }

  double misfit(std::span<const Place> places, double log_rate) const {
    const CauchyLoss loss{kDensityScale};
    double sum = 0.0;
    for (const Place& place : places) {
      const double residual = predicted(place) + log_rate - place.log_density;
      sum += loss.value(residual * residual);
    }
    return rms_of(sum, places.size());
  }

 private:
  Position from_;
  Eigen::Vector3d axis_ = Eigen::Vector3d::Zero();
  Steps steps_;
};

PointDensity::PointDensity(std::span<const Eigen::Vector3f> points, std::span<const Eigen::Vector3f> normals,
                           std::span<const float> surface_variation, const KdTree& tree, double noise_sigma_mm,
                           std::size_t most, const Context& context) {
  constexpr float kMostVariation = 0.04F;
  // One of each of so many even shares of the rows, since about half of them are near an edge.
  Random random(0, "point density", points.size());
  std::vector<std::uint32_t> drawn(std::min(points.size(), 2 * most));
  for (std::size_t d = 0; d < drawn.size(); ++d) {
    const std::size_t begin = points.size() * d / drawn.size(), end = points.size() * (d + 1) / drawn.size();
    drawn[d] = static_cast<std::uint32_t>(begin + random.below(end - begin));
  }
  for (std::size_t d = drawn.size(); d > 1; --d) std::swap(drawn[d - 1], drawn[random.below(d)]);
  std::vector<std::optional<double>> densities(drawn.size());
  parallel_for_blocks(context, drawn.size(), 64, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t d = begin; d < end; ++d) {
      const std::uint32_t i = drawn[d];
      if (surface_variation[i] > kMostVariation || normals[i].isZero(0.0F)) continue;
      densities[d] = log_density_at(points, points[i], normals[i], tree, noise_sigma_mm, neighbours);
    }
  });
  for (std::size_t d = 0; d < drawn.size() && places_.size() < most; ++d) {
    if (!densities[d]) continue;
    places_.push_back({points[drawn[d]].cast<double>(), normals[drawn[d]].cast<double>(), *densities[d]});
  }
  if (places_.empty()) return;
  for (const Place& place : places_) middle_ += place.point / static_cast<double>(places_.size());
  std::vector<double> radii;
  radii.reserve(places_.size());
  for (const Place& place : places_) radii.push_back((place.point - middle_).norm());
  radius_mm_ = std::max(*std::ranges::max_element(radii), 1e-9);
  size_mm_ = std::max(median_of(std::move(radii)), 1e-9);
}

// A scanner that turns stands amid what it measures; looking at things from outside, it makes steps of about even
// angles.
bool PointDensity::may_have(Steps steps, const Position& position_in_scan) const {
  const bool turns = steps == Steps::turns_about_y || steps == Steps::turns_about_z;
  return !turns || (position_in_scan - middle_).norm() < radius_mm_;
}

bool PointDensity::known() const {
  constexpr std::size_t kFewest = 150;
  return places_.size() >= kFewest;
}

double PointDensity::misfit(const Position& position_in_scan) const {
  ASBUILT_EXPECT(known(), "places at which the density was counted");
  double best = std::numeric_limits<double>::infinity();
  for (const Steps steps : kAllSteps) {
    if (!may_have(steps, position_in_scan)) continue;
    const View view(position_in_scan, steps, middle_);
    best = std::min(best, view.misfit(places_, view.best_log_rate(places_)));
  }
  return best;
}

double PointDensity::misfit_of_even() const {
  ASBUILT_EXPECT(known(), "places at which the density was counted");
  std::vector<double> densities;
  densities.reserve(places_.size());
  for (const Place& place : places_) densities.push_back(place.log_density);
  const double middle = median_of(densities);
  const CauchyLoss loss{kDensityScale};
  double sum = 0.0;
  for (const double density : densities) sum += loss.value((density - middle) * (density - middle));
  return rms_of(sum, densities.size());
}

// Levenberg-Marquardt on the position and the rate.
PointDensity::Fit PointDensity::fitted(std::span<const Place> places, Steps steps, const Position& start,
                                       int most_steps) const {
  const CauchyLoss loss{kDensityScale};
  const View first(start, steps, middle_);
  Fit fit{start, steps, first.best_log_rate(places), 0.0};
  fit.misfit = first.misfit(places, fit.log_rate);
  double damping = 1e-3;
  for (int step = 0; step < most_steps && damping < 1e6; ++step) {
    Eigen::Matrix4d normal_matrix = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right_side = Eigen::Vector4d::Zero();
    const View view(fit.position_in_scan, steps, middle_);
    for (const Place& place : places) {
      Eigen::Vector3d gradient;
      const double residual = view.predicted(place, &gradient) + fit.log_rate - place.log_density;
      Eigen::Vector4d row;
      row << size_mm_ * gradient, 1.0;  // lengths in sizes, so that the unknowns are comparable
      const double weight = loss.weight(residual * residual);
      normal_matrix += weight * row * row.transpose();
      right_side -= weight * residual * row;
    }
    bool is_better = false;
    while (!is_better && damping < 1e6) {
      Eigen::Matrix4d damped = normal_matrix;
      damped.diagonal() *= 1.0 + damping;
      damped.diagonal().array() += 1e-9 * static_cast<double>(places.size());
      const Eigen::Vector4d move = damped.ldlt().solve(right_side);
      Fit moved{fit.position_in_scan + size_mm_ * move.head<3>(), steps, fit.log_rate + move[3], 0.0};
      moved.misfit = View(moved.position_in_scan, steps, middle_).misfit(places, moved.log_rate);
      is_better = moved.misfit < fit.misfit;
      damping *= is_better ? 0.2 : 5.0;
      if (!is_better) continue;
      const bool is_still = move.head<3>().norm() < 1e-4 && fit.misfit - moved.misfit < 1e-5 * fit.misfit;
      fit = moved;
      if (is_still) return fit;
    }
  }
  return fit;
}

std::vector<PointDensity::Fit> PointDensity::fits(const Context& context) const {
  constexpr std::size_t kDirections = 24, kCoarse = 600, kMostFits = 3;
  constexpr double kStartInRadii = 1.5, kSameBasin = 0.2, kComparable = 1.25;
  if (!known()) return {};
  const std::span<const Place> places = places_;
  const auto coarse = places.first(std::min(places.size(), kCoarse));
  std::vector<Fit> all(kAllSteps.size() * (kDirections + 1));
  parallel_for(context, all.size(), 1, [&](std::size_t i) {
    if (context.cancelled()) return;
    const std::size_t d = i / kAllSteps.size();  // even directions, on a spiral, and last the midst
    const double z = 1.0 - (2.0 * static_cast<double>(d) + 1.0) / kDirections;
    const double across = std::sqrt(std::max(0.0, 1.0 - z * z));
    const double turn = static_cast<double>(d) * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const Position start =
        middle_ + kStartInRadii * radius_mm_ * Position(across * std::cos(turn), across * std::sin(turn), z);
    all[i] = fitted(coarse, kAllSteps[i % kAllSteps.size()], d < kDirections ? start : middle_, 40);
  });
  std::erase_if(all, [&](const Fit& fit) { return !may_have(fit.steps, fit.position_in_scan); });
  std::ranges::stable_sort(all, {}, &Fit::misfit);
  // One from each basin: of coarse fits, then again of fine ones, since two may meet.
  const auto basins = [&](const std::vector<Fit>& ordered) {
    std::vector<Fit> best;
    for (const Fit& fit : ordered) {
      if (best.size() == kMostFits || fit.misfit > kComparable * ordered.front().misfit) break;
      const bool is_known = std::ranges::any_of(best, [&](const Fit& other) {
        const double apart_mm = (other.position_in_scan - fit.position_in_scan).norm();
        return apart_mm < kSameBasin * std::max((other.position_in_scan - middle_).norm(), size_mm_);
      });
      if (!is_known) best.push_back(fit);
    }
    return best;
  };
  std::vector<Fit> best = basins(all);
  parallel_for(context, best.size(), 1,
               [&](std::size_t b) { best[b] = fitted(places, best[b].steps, best[b].position_in_scan, 20); });
  std::ranges::stable_sort(best, {}, &Fit::misfit);
  return basins(best);
}

}  // namespace asbuilt::scan
