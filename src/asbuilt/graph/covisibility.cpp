// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/covisibility.h"

#include <algorithm>
#include <functional>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::graph {
namespace {

constexpr float kMinCosine = 0.70710678F;  // 45 degrees
// 20 bits an axis (a hundred diameters at the smallest voxel ratio allowed) leave the top four for the side.
constexpr int kBias = 1 << 19;
constexpr VoxelKey kAxisMask = 0xfffffU;

int side_of(const Eigen::Vector3f& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(2 * axis + (normal[axis] < 0.0F ? 1 : 0));
}

VoxelKey cell_key(const CovisibilityGrid& grid, const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
  return key_of({grid.voxels.cell(point.cast<double>()), grid.by_side ? side_of(normal) : 0});
}

PointCloud transformed(const PointCloud& cloud, const Pose& pose, const Context& context) {
  PointCloud moved;
  moved.positions.resize(cloud.size());
  moved.normals.resize(cloud.size());
  parallel_for(context, cloud.size(), 1 << 14, [&](std::size_t i) {
    moved.positions[i] = (pose * cloud.positions[i].cast<double>()).cast<float>();
    moved.normals[i] = (pose.linear() * cloud.normals[i].cast<double>()).cast<float>();
  });
  return moved;
}

void sort_unique(std::vector<VoxelKey>& keys, const Context& context) {
  stable_parallel_sort(context, keys, std::less<>{});
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

// Samples of the model that have an observed point nearby which faces the same way.
std::vector<char> visible_samples(const PointCloud& observed, const PointCloud& samples, double reach,
                                  const Context& context) {
  // A few points a voxel answer "is there one nearby" as well as millions do.
  const std::vector<std::uint32_t> subset = even_subset(observed.positions, reach / (3.0 * kVisibleReach), context);
  std::vector<Eigen::Vector3f> positions, normals;
  for (const std::uint32_t i : subset) {
    positions.push_back(observed.positions[i]);
    normals.push_back(observed.normals[i]);
  }
  const KdTree tree(positions);
  std::vector<char> visible(samples.size(), 0);
  parallel_for(context, samples.size(), 512, [&](std::size_t i) {
    visible[i] =
        tree.nearest_facing(samples.positions[i], static_cast<float>(reach), normals, samples.normals[i], kMinCosine)
            .found();
  });
  return visible;
}

}  // namespace

VoxelKey key_of(const Cell& cell) {
  const auto part = [](int value) { return static_cast<VoxelKey>(value + kBias) & kAxisMask; };
  return (static_cast<VoxelKey>(cell.side) << 60) | (part(cell.voxel.z()) << 40) | (part(cell.voxel.y()) << 20) |
         part(cell.voxel.x());
}

Cell cell_of(VoxelKey key) {
  const auto part = [&](int shift) { return static_cast<int>((key >> shift) & kAxisMask) - kBias; };
  return {Eigen::Vector3i(part(0), part(20), part(40)), static_cast<int>(key >> 60)};
}

std::vector<VoxelKey> visible_cells(const PointCloud& segment_in_scan, const Pose& model_from_scan,
                                    const PointCloud& model_samples, const CovisibilityGrid& grid,
                                    const Context& context) {
  if (segment_in_scan.empty()) return {};
  const PointCloud observed = transformed(segment_in_scan, model_from_scan, context);
  std::vector<VoxelKey> cells(observed.size());
  parallel_for(context, observed.size(), 1 << 14,
               [&](std::size_t i) { cells[i] = cell_key(grid, observed.positions[i], observed.normals[i]); });
  sort_unique(cells, context);

  const double reach = kVisibleReach * grid.voxels.size;
  const std::vector<char> visible = visible_samples(observed, model_samples, reach, context);
  for (std::size_t i = 0; i < model_samples.size(); ++i) {
    if (visible[i]) cells.push_back(cell_key(grid, model_samples.positions[i], model_samples.normals[i]));
  }
  sort_unique(cells, context);
  return cells;
}

}  // namespace asbuilt::graph
