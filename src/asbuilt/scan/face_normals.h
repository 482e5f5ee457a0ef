// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/point_cloud.h"

namespace asbuilt::scan {

/// The normal, at each point, of the one face that the point lies on; unit length, turned as those of the cloud.
///
/// A plane fitted to all neighbours leans wherever an edge is near, and on a thin profile that is everywhere. Here
/// planes through the point compete - turned as the normals of its neighbours are, or spanned by two of them - and the
/// one that keeps most neighbours within the noise wins; reweighted fits to those that it keeps follow. `tree` is over
/// the cloud's positions. The same for any number of threads. Cost: some 10 us a point near an edge, 3 us elsewhere.
[[nodiscard]] std::vector<Eigen::Vector3f> face_normals(const PointCloud& cloud, const KdTree& tree,
                                                        double noise_sigma_mm, double spacing_mm,
                                                        const Context& context);

/// The same at the points `at` alone, in their order.
[[nodiscard]] std::vector<Eigen::Vector3f> face_normals_at(std::span<const std::uint32_t> at, const PointCloud& cloud,
                                                           const KdTree& tree, double noise_sigma_mm, double spacing_mm,
                                                           const Context& context);

}  // namespace asbuilt::scan
