// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"

namespace asbuilt::model {

/// Normals of `samples` as a scan would have them: fitted to the plane of all `dense` points within `radius_mm` that
/// lie on the same side (face normal within 90 degrees of the sample's), pointing where the sample's face normal
/// points.
[[nodiscard]] std::vector<Eigen::Vector3f> fitted_normals(const PointCloud& samples, const PointCloud& dense,
                                                          double radius_mm, const Context& context);

}  // namespace asbuilt::model
