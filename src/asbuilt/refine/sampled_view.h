// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/refine/rim_points.h"

namespace asbuilt::refine {

/// An evenly spread subset of about `count` points (all of them if there are no more): cubes whose edge is found by
/// secant steps on the logarithm of the count. Normals come along.
[[nodiscard]] PointCloud evenly_sampled(const PointCloud& cloud, std::size_t count, const Context& context);

/// Where a point lies in its cloud. Seen along the point's normal, neighbours within 2.5 spacings leave an angle of
/// more than 120 degrees free at an edge and at a rim; at a sharp edge the surface goes on below, at a rim it ends.
enum class Place : char { inside, edge, rim };
[[nodiscard]] std::vector<Place> places_of(const PointCloud& cloud, const KdTree& tree, double spacing_mm,
                                           const Context& context);

/// How views are sampled and what their points count.
struct SamplingRules {
  std::size_t points = 25000, coarse_points = 2500;
  bool face_normals = true;  ///< normals fitted anew, to the points of one face only
  bool rim_weights = true;   ///< what may be mixed with something behind it hardly counts

  bool operator==(const SamplingRules&) const = default;
};

/// A view as the refinement works with it, in its own scan frame. Copies share the tree.
struct SampledView {
  PointCloud points;                  ///< 20-30 k evenly spread points
  std::vector<std::uint32_t> coarse;  ///< an even subset of `points` for the first steps
  std::vector<float> weight;          ///< of each point, in (0, 1]
  std::vector<char> near_rim;         ///< of each point, where rims are weighed: its weight is that of rims
  RimPoints rims;                     ///< where its flat faces end (find_rims)
  std::vector<char> on_flat_face;     ///< of each point, after find_rims: its neighbours have its normal
  double spacing_mm = 0.0;
  double fit_radius_mm = 0.0;  ///< how far the plane at a point has been fitted
  double noise_sigma_mm = 0.0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  double radius_mm = 0.0;              ///< root mean squared distance from the centroid
  std::shared_ptr<const KdTree> tree;  ///< over `points`
  SamplingRules rules;                 ///< that it was sampled by
};

[[nodiscard]] SampledView sampled_view(const PointCloud& segment, double noise_sigma_mm, const SamplingRules& rules,
                                       const Context& context);

/// Measures where the faces of `view`, sampled from `segment`, end. `beside_occluder`: of each point of the segment
/// (scan::Occluders); without it no rim is taken for an end.
void find_rims(SampledView& view, const PointCloud& segment, std::span<const std::uint8_t> beside_occluder,
               const Context& context);

}  // namespace asbuilt::refine
