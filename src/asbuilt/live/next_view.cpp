// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/next_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::live {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kDirections = 160;
constexpr double kSamplesAcross = 45.0;  // to a diameter
constexpr double kSeenWell = 0.5;
constexpr double kWantedOverlap = 0.25;  // pairs are linked from 0.10 on: some room for what clutter hides
constexpr double kWorthwhile = 0.002;    // of the skin

double quantile(std::vector<double>& values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, place);
  return *place;
}

// Directions spread evenly over the sphere (Fibonacci).
std::vector<Eigen::Vector3d> even_directions(int count) {
  std::vector<Eigen::Vector3d> directions;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count, r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  return directions;
}

std::vector<Eigen::Vector3d> targets(const model::PreparedModel& model, const SensorLimits& limits, double distance) {
  std::vector<Eigen::Vector3d> all{model.box.center()};
  const double field = std::tan(std::min(limits.half_angle_deg, 80.0) * kDegree) * distance;
  if (field > 0.45 * model.diameter) return all;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d sign(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    all.emplace_back(model.box.center() + 0.25 * sign.cwiseProduct(model.box.sizes()));
  }
  return all;
}

std::vector<SensorView> candidate_views(const model::PreparedModel& model, const SensorLimits& limits) {
  const double radius = 0.5 * model.diameter;
  std::vector<double> distances{std::max(limits.distance_mm, limits.near_mm + 0.2 * radius)};
  const double close = std::max(1.1 * radius, limits.near_mm + radius);
  if (close < 0.75 * distances.front()) distances.push_back(close);
  std::vector<SensorView> views;
  for (const double distance : distances) {
    for (const Eigen::Vector3d& target : targets(model, limits, distance)) {
      for (const Eigen::Vector3d& direction : even_directions(kDirections)) {
        views.push_back({target + distance * direction, target});
      }
    }
  }
  return views;
}

}  // namespace

double seen_weight(double cos_incidence) {
  const double full = 0.5, none = std::cos(75.0 * kDegree);
  return std::clamp((cos_incidence - none) / (full - none), 0.0, 1.0);
}

SensorLimits assumed_limits(double diameter_mm) {
  return {25.0, 0.3 * diameter_mm, 4.0 * diameter_mm, 1.5 * diameter_mm, "assumed"};
}

SensorLimits limits_seen(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3d& viewpoint_in_scan,
                         const Eigen::Vector3d& middle_of_part_in_scan, double diameter_mm) {
  // A few thousand points tell as much as all of them.
  const std::size_t stride = std::max<std::size_t>(1, points.size() / 4000);
  std::vector<Eigen::Vector3d> directions;
  std::vector<double> ranges;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const Eigen::Vector3d ray = points[i].cast<double>() - viewpoint_in_scan;
    const double range = ray.norm();
    if (!std::isfinite(range) || range <= 0.0 || points[i].isZero(0.0F)) continue;
    directions.push_back(ray / range);
    ranges.push_back(range);
  }
  SensorLimits limits;
  if (directions.empty()) return limits;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& d : directions) mean += d;
  std::vector<double> angles;
  const bool all_around = mean.norm() < 0.3 * static_cast<double>(directions.size());
  for (const Eigen::Vector3d& d : directions) {
    angles.push_back(std::acos(std::clamp(d.dot(mean.normalized()), -1.0, 1.0)) / kDegree);
  }
  limits.half_angle_deg = all_around ? 180.0 : std::max(5.0, quantile(angles, 0.90));
  limits.distance_mm = (middle_of_part_in_scan - viewpoint_in_scan).norm();
  const double radius = 0.5 * diameter_mm;
  limits.near_mm = std::max(0.0, std::min(quantile(ranges, 0.01), limits.distance_mm - radius));
  limits.far_mm = std::max(quantile(ranges, 0.99), limits.distance_mm + radius);
  limits.source = "learnt";
  return limits;
}

SensorLimits learnt_limits(const std::vector<SensorLimits>& seen) {
  ASBUILT_EXPECT(!seen.empty(), "at least one scan");
  SensorLimits all = seen.front();
  std::vector<double> distances;
  for (const SensorLimits& one : seen) {
    all.half_angle_deg = std::max(all.half_angle_deg, one.half_angle_deg);
    all.near_mm = std::min(all.near_mm, one.near_mm);
    all.far_mm = std::max(all.far_mm, one.far_mm);
    distances.push_back(one.distance_mm);
  }
  all.distance_mm = quantile(distances, 0.5);
  return all;
}

ViewPlanner::ViewPlanner(const Surface& surface, const model::PreparedModel& model, const SensorLimits& limits,
                         const Context& context)
    : limits_(limits), candidates_(candidate_views(model, limits)) {
  const auto& vertices = surface.mesh.vertices;
  std::vector<Eigen::Vector3f> positions(vertices.size());
  for (std::size_t v = 0; v < positions.size(); ++v) positions[v] = vertices[v].cast<float>();
  // The two sides of a thin wall are sampled each on its own: by the axis next to the normal.
  for (int side = 0; side < 6; ++side) {
    std::vector<std::uint32_t> members;
    std::vector<Eigen::Vector3f> points;
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
      Eigen::Index axis = 0;
      surface.mesh.normals[v].cwiseAbs().maxCoeff(&axis);
      if (2 * axis + (surface.mesh.normals[v][axis] < 0.0F ? 1 : 0) != side) continue;
      members.push_back(v);
      points.push_back(positions[v]);
    }
    for (const std::uint32_t i : even_subset(points, model.diameter / kSamplesAcross, context)) {
      samples_.push_back(members[i]);
    }
  }
  std::vector<Eigen::Vector3f> sample_points, sample_normals;
  for (const std::uint32_t v : samples_) {
    sample_points.push_back(positions[v]);
    sample_normals.push_back(surface.mesh.normals[v]);
  }
  const KdTree tree(sample_points);
  nearest_sample_.resize(positions.size());
  parallel_for(context, positions.size(), 512, [&](std::size_t v) {
    const auto same_way = tree.nearest_facing(positions[v], static_cast<float>(0.2 * model.diameter), sample_normals,
                                              surface.mesh.normals[v], 0.5F);
    nearest_sample_[v] = same_way.found() ? same_way.index : tree.nearest(positions[v]).index;
  });
  sample_area_.assign(samples_.size(), 0.0);
  vertex_area_.resize(positions.size());
  for (std::size_t v = 0; v < positions.size(); ++v) {
    vertex_area_[v] = surface.area_mm2[v] / surface.total_area_mm2;
    sample_area_[nearest_sample_[v]] += vertex_area_[v];
  }

  sees_.assign(candidates_.size() * samples_.size(), 0);
  const double lift = 1e-4 * model.diameter, cos_field = std::cos(limits.half_angle_deg * kDegree);
  parallel_for(context, candidates_.size(), 1, [&](std::size_t c) {
    const SensorView& view = candidates_[c];
    const Eigen::Vector3d looks = view.direction();
    for (std::size_t s = 0; s < samples_.size(); ++s) {
      const Eigen::Vector3d normal = surface.mesh.normals[samples_[s]].cast<double>();
      const Eigen::Vector3d point = vertices[samples_[s]] + lift * normal;
      const Eigen::Vector3d to_sensor = view.position - point;
      const double range = to_sensor.norm();
      if (range < limits.near_mm || (limits.far_mm > 0.0 && range > limits.far_mm)) continue;
      const double weight = seen_weight(normal.dot(to_sensor) / range);
      if (weight <= 0.0 || -looks.dot(to_sensor) / range < cos_field) continue;
      if (model.rays->is_blocked(point, to_sensor, 0.0, 1.0)) continue;
      sees_[c * samples_.size() + s] = static_cast<std::uint8_t>(std::lround(255.0 * weight));
    }
  });
  coverable_.assign(samples_.size(), 0);
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    for (std::size_t s = 0; s < samples_.size(); ++s) {
      if (sees(c, s) >= static_cast<float>(kSeenWell)) coverable_[s] = 1;
    }
  }
}

double ViewPlanner::coverable_share() const {
  double sum = 0.0;
  for (std::size_t s = 0; s < samples_.size(); ++s) sum += coverable_[s] ? sample_area_[s] : 0.0;
  return std::min(sum, 1.0);
}

std::vector<double> ViewPlanner::seen_shares(const std::vector<char>& seen) const {
  std::vector<double> shares(samples_.size(), 0.0);
  for (std::size_t v = 0; v < seen.size(); ++v) {
    if (seen[v] != 0) shares[nearest_sample_[v]] += vertex_area_[v];
  }
  for (std::size_t s = 0; s < shares.size(); ++s) {
    shares[s] = sample_area_[s] > 0.0 ? std::min(1.0, shares[s] / sample_area_[s]) : 0.0;
  }
  return shares;
}

namespace {

struct Worth {
  double gain = 0.0, seen = 0.0, overlap_first = 0.0, overlap_other = 0.0;
};

}  // namespace

std::vector<ViewProposal> ViewPlanner::best_views(const std::vector<std::vector<char>>& seen_by_component) const {
  const std::size_t pieces = seen_by_component.size(), count = samples_.size();
  std::vector<std::vector<double>> has;
  std::vector<char> seen_by_any(nearest_sample_.size(), 0);
  for (const std::vector<char>& seen : seen_by_component) {
    has.push_back(seen_shares(seen));
    for (std::size_t v = 0; v < seen.size(); ++v) seen_by_any[v] = static_cast<char>(seen_by_any[v] | seen[v]);
  }
  const std::vector<double> any = seen_shares(seen_by_any);
  const auto worth = [&](std::size_t c, std::size_t other) {
    Worth sum;
    for (std::size_t s = 0; s < count; ++s) {
      const double area = sample_area_[s] * static_cast<double>(sees(c, s));
      if (area <= 0.0) continue;
      sum.seen += area;
      sum.gain += (1.0 - any[s]) * area;
      if (pieces > 0) sum.overlap_first += has[0][s] * area;
      if (other > 0) sum.overlap_other += has[other][s] * area;
    }
    return sum;
  };

  std::vector<ViewProposal> ranked;
  std::vector<double> merit;
  const auto consider = [&](std::size_t c, std::size_t other) {
    const Worth value = worth(c, other);
    if (value.seen <= 0.0) return;
    ViewProposal proposal{candidates_[c], Purpose::coverage, value.gain, value.overlap_first / value.seen, -1};
    double score = value.gain;
    if (pieces == 0) proposal.purpose = Purpose::first;
    if (other > 0) {
      // What joins two pieces shares enough with the lesser sharer; new surface breaks ties.
      proposal.purpose = Purpose::join;
      proposal.joins = static_cast<int>(other);
      const double shared = std::min(value.overlap_first, value.overlap_other) / value.seen;
      if (shared < 0.05) return;
      score = 10.0 + std::min(shared, kWantedOverlap) + 0.1 * value.gain;
    } else if (pieces > 0) {
      score *= std::min(1.0, proposal.overlap / kWantedOverlap);
      if (value.gain < kWorthwhile) return;
    }
    ranked.push_back(proposal);
    merit.push_back(score);
  };
  for (std::size_t c = 0; c < candidates_.size(); ++c) {
    consider(c, 0);
    if (pieces > 1) consider(c, 1);
  }
  std::vector<std::size_t> order(ranked.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return merit[a] > merit[b]; });

  std::vector<ViewProposal> best;
  constexpr double kAlike = 0.9;  // 26 degrees
  for (const std::size_t i : order) {
    const bool alike = std::ranges::any_of(best, [&](const ViewProposal& chosen) {
      return chosen.view.direction().dot(ranked[i].view.direction()) > kAlike;
    });
    if (!alike) best.push_back(ranked[i]);
    if (best.size() == 3) break;
  }
  return best;
}

}  // namespace asbuilt::live
