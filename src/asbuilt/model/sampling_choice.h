// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/ray_scene.h"

namespace asbuilt::model {

/// tau, the detection sampling relative to the diameter, in the paper's range of 0.025 to 0.05: as coarse as gives some
/// 1000 samples and four samples across the part's smallest extent, but no finer than 2500 samples.
[[nodiscard]] double choose_sampling_ratio(const TriangleMesh& skin);

/// Extent of the mesh along its three principal directions, smallest first, mm.
[[nodiscard]] Eigen::Vector3d principal_extents(const TriangleMesh& mesh);

/// The wall thickness that nine tenths of the samples exceed, from rays into the material; infinity for an open sheet.
[[nodiscard]] double thin_wall(const PointCloud& samples, const RayScene& rays, double diameter);

/// Voxel of the distance field: half the thin wall, between 1/400 and 1/256 of the diameter, and coarser where the
/// surface is so large that the field would outgrow its memory.
[[nodiscard]] double choose_voxel(double diameter, double surface_area, double thin_wall);

}  // namespace asbuilt::model
