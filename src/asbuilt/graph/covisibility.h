// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::graph {

/// How a scan is entered in the voxel grid over the model.
struct CovisibilityGrid {
  VoxelGrid voxels;
  /// Tell the sides of a thin wall apart: a cell is then a voxel and the axis direction (of six) next to the surface
  /// normal. Off in paper mode, where a voxel is a voxel.
  bool by_side = true;
};

/// What a cell's key says.
struct Cell {
  Eigen::Vector3i voxel = Eigen::Vector3i::Zero();
  int side = 0;  ///< 0..5: +x, -x, +y, -y, +z, -z, next to the normal; 0 where sides are not told apart
};
[[nodiscard]] VoxelKey key_of(const Cell& cell);
[[nodiscard]] Cell cell_of(VoxelKey key);

/// Share of a voxel's edge within which an observed point makes a model sample visible.
inline constexpr double kVisibleReach = 1.5;

/// The cells that a scan sees, ascending, each once: those that hold a point of its segment, and those of the model
/// samples visible in it. A model sample counts as visible when an observed point lies within 1.5 voxels of it and
/// their normals agree within 45 degrees: then the sensor saw this side of the surface, at this place, whatever
/// else stood in the scene - no ray needs to be cast against things nobody has modelled - and an as-built surface that
/// has left its nominal voxel is still found there.
///
/// `segment_in_scan` has normals, or is empty. Source: Sec. 3.2.
[[nodiscard]] std::vector<VoxelKey> visible_cells(const PointCloud& segment_in_scan, const Pose& model_from_scan,
                                                  const PointCloud& model_samples, const CovisibilityGrid& grid,
                                                  const Context& context);

}  // namespace asbuilt::graph
