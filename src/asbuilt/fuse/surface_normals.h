// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"

namespace asbuilt::fuse {

/// A normal for each point, along which it may be moved without leaving its face; unit length, turned as given.
///
/// The cloud's own normals lean wherever an edge is near, and on a thin profile that is everywhere. So normals are
/// fitted to the points of one face each (scan/face_normals.h). They replace a given one that they contradict by more
/// than 8 degrees, if under them clearly more of the nearest neighbours lie on one surface with the point; on a curved
/// surface sampled coarsely they do not. Without noise or spacing (0) the given ones stand. The same for any number of
/// threads.
[[nodiscard]] std::vector<Eigen::Vector3f> surface_normals(const PointCloud& cloud, double noise_sigma_mm,
                                                           double spacing_mm, const Context& context);

}  // namespace asbuilt::fuse
