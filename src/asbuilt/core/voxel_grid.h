// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"

namespace asbuilt {

/// Cell of a point on a grid of cubes; 21 bits an axis, so 2 million cells either side of the origin's half range.
using VoxelKey = std::uint64_t;

/// Grid of cubes of `size` mm whose cell (0,0,0) starts at `origin`.
struct VoxelGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double size = 1.0;

  [[nodiscard]] Eigen::Vector3i cell(const Eigen::Vector3d& point) const {
    return ((point - origin) / size).array().floor().cast<int>();
  }
  [[nodiscard]] static VoxelKey key_of_cell(const Eigen::Vector3i& cell) {
    constexpr int kBias = 1 << 20;
    const auto part = [](int value) { return static_cast<VoxelKey>(value + kBias) & 0x1fffffU; };
    return (part(cell.z()) << 42) | (part(cell.y()) << 21) | part(cell.x());
  }
  [[nodiscard]] VoxelKey key(const Eigen::Vector3d& point) const { return key_of_cell(cell(point)); }
};

/// Indices of an evenly spread subset: of each occupied cube of `spacing` mm the point nearest to the mean of
/// the cube's points. Ascending; the same for any number of threads. Cost O(n log n).
[[nodiscard]] std::vector<std::uint32_t> even_subset(std::span<const Eigen::Vector3f> points, double spacing,
                                                     const Context& context);

/// Median distance of a point to its nearest neighbour, from at most `max_probes` probes spread over the index range.
/// 0 for fewer than two points.
[[nodiscard]] double median_spacing(std::span<const Eigen::Vector3f> points, std::size_t max_probes = 2000);

/// The same with a tree over these very points, for callers that have one.
[[nodiscard]] double median_spacing(std::span<const Eigen::Vector3f> points, const KdTree& tree,
                                    std::size_t max_probes = 2000);

}  // namespace asbuilt
