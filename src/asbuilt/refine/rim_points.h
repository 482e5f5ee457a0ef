// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/point_cloud.h"

namespace asbuilt::refine {

/// Where the flat faces of a view end, and nothing of the face across the edge was seen.
///
/// The outermost sample of a face lies anywhere within a spacing before its edge. The end is told by area instead:
/// samples of even density up to the edge, counted in a window along the rim, fill the face as far as it goes
/// (`ends.positions`, good to about `spacing / sqrt(12)` across the rim). `ends.normals` point out of the face, in its
/// plane and across the rim.
struct RimPoints {
  PointCloud ends;
  std::vector<Eigen::Vector3f> face_normals;  ///< of the face that ends
};

/// The ends of faces at `rim`, indices of points of `cloud` at a rim (Place::rim). Points whose face is not flat or
/// whose rim is not straight for some spacings, or before which samples are too few or uneven, are left out.
[[nodiscard]] RimPoints rim_points(const PointCloud& cloud, const KdTree& tree, std::span<const std::uint32_t> rim,
                                   double spacing_mm, double noise_sigma_mm, const Context& context);

}  // namespace asbuilt::refine
