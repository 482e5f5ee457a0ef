// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/sampled_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/scan/face_normals.h"
#include "asbuilt/scan/normals.h"

namespace asbuilt::refine {
namespace {

constexpr double kNeighbourhood = 2.5;                       // spacings
constexpr double kFreeAngle = 2.0 * std::numbers::pi / 3.0;  // 120 degrees
constexpr int kWallPoints = 3;        // neighbours straight below that make a border point one of an edge
constexpr double kRimInSpacings = 5;  // spacings of the scan itself: as far as mixed measurements reach

std::vector<std::uint32_t> even_indices(std::span<const Eigen::Vector3f> points, std::size_t count,
                                        const Context& context) {
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0U);
  if (points.size() <= count) return all;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& point : points) box.extend(point);
  const double extent = box.diagonal().norm();
  if (!(extent > 0.0)) return {0U};

  // On a surface the number of occupied cubes falls with the square of their edge: a few corrections suffice.
  const auto wanted = static_cast<double>(count);
  double spacing = extent / std::sqrt(wanted);
  std::vector<std::uint32_t> best;
  for (int attempt = 0; attempt < 6; ++attempt) {
    best = even_subset(points, spacing, context);
    const double ratio = static_cast<double>(best.size()) / wanted;
    if (ratio > 0.9 && ratio < 1.1) break;
    spacing *= std::clamp(std::sqrt(ratio), 0.1, 10.0);
  }
  return best;
}

PointCloud chosen(const PointCloud& cloud, std::span<const std::uint32_t> indices) {
  PointCloud subset;
  for (const std::uint32_t i : indices) {
    subset.positions.push_back(cloud.positions[i]);
    if (cloud.has_normals()) subset.normals.push_back(cloud.normals[i]);
  }
  return subset;
}

// Counting cubes over tens of millions of points would take longer than the refinement; every nth of them will do.
PointCloud thinned(const PointCloud& cloud, std::size_t at_most) {
  const std::size_t step = (cloud.size() + at_most - 1) / at_most;
  std::vector<std::uint32_t> indices;
  for (std::size_t i = 0; i < cloud.size(); i += step) indices.push_back(static_cast<std::uint32_t>(i));
  return chosen(cloud, indices);
}

struct Surroundings {
  double free_angle = 2.0 * std::numbers::pi;  ///< the largest one around the normal without a neighbour
  int below = 0;                               ///< neighbours straight above or below: a wall at an edge
};

Surroundings surroundings_of(const Eigen::Vector3f& centre, const Eigen::Vector3f& normal, const PointCloud& cloud,
                             std::span<const KdTree::Neighbour> neighbours, std::vector<double>& angles) {
  const Eigen::Vector3f u = normal.unitOrthogonal(), v = normal.cross(u);
  Surroundings result;
  angles.clear();
  for (const KdTree::Neighbour& neighbour : neighbours) {
    const Eigen::Vector3f offset = cloud.positions[neighbour.index] - centre;
    const float a = offset.dot(u), b = offset.dot(v);
    // Neighbours straight above or below have no direction to speak of.
    const float across = a * a + b * b;
    if (across > 0.05F * neighbour.squared_distance) angles.push_back(std::atan2(b, a));
    result.below += across < 0.5F * neighbour.squared_distance ? 1 : 0;
  }
  if (angles.size() < 3) return result;
  std::ranges::sort(angles);
  double widest = angles.front() + 2.0 * std::numbers::pi - angles.back();
  for (std::size_t i = 1; i < angles.size(); ++i) widest = std::max(widest, angles[i] - angles[i - 1]);
  result.free_angle = widest;
  return result;
}

// Every point within `reach_mm` of a marked one of `others`.
std::vector<char> near_marked(std::span<const std::uint8_t> marked, const PointCloud& others, const PointCloud& cloud,
                              double reach_mm, const Context& context) {
  std::vector<Eigen::Vector3f> seeds;
  for (std::size_t i = 0; i < marked.size(); ++i) {
    if (marked[i] != 0) seeds.push_back(others.positions[i]);
  }
  std::vector<char> result(cloud.size(), 0);
  if (seeds.empty()) return result;
  const KdTree seed_tree(seeds);
  parallel_for(context, cloud.size(), 512, [&](std::size_t i) {
    result[i] = seed_tree.nearest(cloud.positions[i], static_cast<float>(reach_mm)).found() ? 1 : 0;
  });
  return result;
}

// At a rim the sensor may have mixed the part with what stands behind it, and the surface ends there: such a point is
// biased rather than noisy. It counts so little that it decides nothing where there are others, but not nothing: where
// two scans share only their rims, these still hold them together. Of a part of small features nearly all is near a
// rim, among it what holds the pose best: at most half of a view's weight is given up.
void weigh_rims(SampledView& view, const std::vector<Place>& places, double scan_spacing_mm, const Context& context) {
  constexpr double kNearRim = 0.03, kLeastLeft = 0.5;
  std::vector<std::uint8_t> rim(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) rim[i] = places[i] == Place::rim ? 1 : 0;
  view.near_rim = near_marked(rim, view.points, view.points, kRimInSpacings * scan_spacing_mm, context);
  const auto all = static_cast<double>(view.near_rim.size());
  const auto near = static_cast<double>(std::ranges::count(view.near_rim, 1));
  const double wanted = near > 0.0 ? (kLeastLeft * all - (all - near)) / near : 1.0;
  const auto weight = static_cast<float>(std::max(kNearRim, wanted));
  for (std::size_t i = 0; i < view.weight.size(); ++i) view.weight[i] = view.near_rim[i] != 0 ? weight : 1.0F;
}

// Beside an edge, on a boss and in a dent a normal leans, and the plane through the point is nobody's.
std::vector<char> on_flat_faces(const SampledView& view, const Context& context) {
  constexpr float kAlike = 0.97F;  // cosine
  constexpr float kLeastAlike = 0.85F;
  const auto radius = static_cast<float>(kNeighbourhood * view.spacing_mm);
  std::vector<char> flat(view.points.size(), 0);
  parallel_for_blocks(context, flat.size(), 512, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      view.tree->within(view.points.positions[i], radius, neighbours);
      const auto alike = std::ranges::count_if(neighbours, [&](const KdTree::Neighbour& neighbour) {
        return view.points.normals[neighbour.index].dot(view.points.normals[i]) > kAlike;
      });
      flat[i] = static_cast<float>(alike) >= kLeastAlike * static_cast<float>(neighbours.size()) ? 1 : 0;
    }
  });
  return flat;
}

// The points at a rim at which the surface does not go on behind something nearer.
std::vector<std::uint32_t> open_rim(const SampledView& view, const std::vector<Place>& places,
                                    const PointCloud& segment, std::span<const std::uint8_t> beside_occluder,
                                    const Context& context) {
  constexpr double kBesideInSpacings = 1.5;
  const std::vector<char> covered =
      near_marked(beside_occluder, segment, view.points, kBesideInSpacings * view.spacing_mm, context);
  std::vector<std::uint32_t> rim;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (places[i] == Place::rim && covered[i] == 0) rim.push_back(static_cast<std::uint32_t>(i));
  }
  return rim;
}

}  // namespace

PointCloud evenly_sampled(const PointCloud& cloud, std::size_t count, const Context& context) {
  if (cloud.size() <= count) return cloud;
  constexpr std::size_t kManyPerCube = 24;
  const PointCloud thin = thinned(cloud, kManyPerCube * count);
  return chosen(thin, even_indices(thin.positions, count, context));
}

std::vector<Place> places_of(const PointCloud& cloud, const KdTree& tree, double spacing_mm, const Context& context) {
  std::vector<Place> places(cloud.size(), Place::inside);
  const auto radius = static_cast<float>(kNeighbourhood * spacing_mm);
  parallel_for_blocks(context, cloud.size(), 512, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    std::vector<double> angles;
    for (std::size_t i = begin; i < end; ++i) {
      tree.within(cloud.positions[i], radius, neighbours);
      const Surroundings around = surroundings_of(cloud.positions[i], cloud.normals[i], cloud, neighbours, angles);
      if (around.free_angle > kFreeAngle) places[i] = around.below >= kWallPoints ? Place::edge : Place::rim;
    }
  });
  return places;
}

SampledView sampled_view(const PointCloud& segment, double noise_sigma_mm, const SamplingRules& rules,
                         const Context& context) {
  SampledView view;
  view.rules = rules;
  view.points = evenly_sampled(segment, rules.points, context);
  view.coarse = even_indices(view.points.positions, rules.coarse_points, context);
  view.noise_sigma_mm = noise_sigma_mm;
  view.tree = std::make_shared<const KdTree>(view.points.positions);
  view.spacing_mm = median_spacing(view.points.positions, *view.tree);
  const auto fitted = static_cast<double>(scan::neighbours_for_normals(noise_sigma_mm, view.spacing_mm));
  view.fit_radius_mm = std::sqrt(fitted / std::numbers::pi) * view.spacing_mm;
  if (rules.face_normals) {
    view.points.normals = scan::face_normals(view.points, *view.tree, noise_sigma_mm, view.spacing_mm, context);
  }
  view.weight.assign(view.points.size(), 1.0F);
  if (rules.rim_weights && view.spacing_mm > 0.0) {
    const std::vector<Place> places = places_of(view.points, *view.tree, view.spacing_mm, context);
    weigh_rims(view, places, median_spacing(segment.positions), context);
  }
  for (const Eigen::Vector3f& point : view.points.positions) view.centroid += point.cast<double>();
  const auto count = static_cast<double>(view.points.size());
  view.centroid /= count;
  double squared = 0.0;
  for (const Eigen::Vector3f& point : view.points.positions) {
    squared += (point.cast<double>() - view.centroid).squaredNorm();
  }
  view.radius_mm = std::sqrt(squared / count);
  return view;
}

void find_rims(SampledView& view, const PointCloud& segment, std::span<const std::uint8_t> beside_occluder,
               const Context& context) {
  if (beside_occluder.size() != segment.size() || !(view.spacing_mm > 0.0)) return;
  const std::vector<Place> places = places_of(view.points, *view.tree, view.spacing_mm, context);
  const std::vector<std::uint32_t> rim = open_rim(view, places, segment, beside_occluder, context);
  view.on_flat_face = on_flat_faces(view, context);
  view.rims = rim_points(view.points, *view.tree, rim, view.spacing_mm, view.noise_sigma_mm, context);
}

}  // namespace asbuilt::refine
