// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"

namespace asbuilt::scan {

/// The plane of least squares through some of `points`; its normal has no preferred sign.
struct PlaneFit {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float variation = 1.0F;  ///< smallest eigenvalue of the covariance / sum of all: 0 on a plane, up to 1/3 in a corner
};
[[nodiscard]] PlaneFit fit_plane(std::span<const Eigen::Vector3f> points,
                                 std::span<const KdTree::Neighbour> neighbours);

/// Plane fits over the `count` nearest neighbours of each point; the normals' signs mean nothing. `spacing_mm` is about
/// that of the points: it tells what is gathered together, not what is found.
struct FittedNormals {
  std::vector<Eigen::Vector3f> normals;
  std::vector<float> variation;
};
[[nodiscard]] FittedNormals fitted_normals(std::span<const Eigen::Vector3f> points, const KdTree& tree,
                                           double spacing_mm, std::size_t count, const Context& context);

/// Sensor noise, 1 sigma in mm: the median over probes of the residual of a local quadric, which curvature does not
/// inflate as it would a plane's. From at most `max_probes` neighbourhoods.
[[nodiscard]] double estimate_noise(std::span<const Eigen::Vector3f> points, const KdTree& tree, const Context& context,
                                    std::size_t max_probes = 2000);

/// Neighbours that a plane fit needs so that noise tilts its normal by about 3 degrees.
[[nodiscard]] std::size_t neighbours_for_normals(double noise_sigma_mm, double spacing_mm);

}  // namespace asbuilt::scan
