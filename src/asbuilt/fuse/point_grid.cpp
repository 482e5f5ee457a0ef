// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/point_grid.h"

#include <algorithm>
#include <functional>

#include "asbuilt/core/parallel.h"

namespace asbuilt::fuse {

PointGrid::PointGrid(std::span<const Eigen::Vector3f> points, double cell_mm, const Context& context) {
  Eigen::Vector3f low = points.empty() ? Eigen::Vector3f::Zero().eval() : points.front();
  for (const Eigen::Vector3f& point : points) low = low.cwiseMin(point);
  // One cube of margin keeps every neighbour's key in range and in order.
  grid_ = {low.cast<double>().array() - 2.0 * cell_mm, cell_mm};

  std::vector<std::pair<VoxelKey, std::uint32_t>> keyed(points.size());
  parallel_for(context, points.size(), 1 << 14, [&](std::size_t i) {
    keyed[i] = {grid_.key(points[i].cast<double>()), static_cast<std::uint32_t>(i)};
  });
  stable_parallel_sort(context, keyed, std::less<>{});
  order_.reserve(keyed.size());
  positions_.reserve(keyed.size());
  for (const auto& [key, index] : keyed) {
    if (keys_.empty() || keys_.back() != key) {
      keys_.push_back(key);
      starts_.push_back(order_.size());
    }
    order_.push_back(index);
    positions_.push_back(points[index]);
  }
  starts_.push_back(order_.size());
}

std::pair<std::size_t, std::size_t> PointGrid::points_between(VoxelKey first, VoxelKey last) const {
  const auto begin = std::lower_bound(keys_.begin(), keys_.end(), first);
  auto end = begin;
  while (end != keys_.end() && *end <= last) ++end;  // three cubes at most
  return {starts_[static_cast<std::size_t>(begin - keys_.begin())],
          starts_[static_cast<std::size_t>(end - keys_.begin())]};
}

}  // namespace asbuilt::fuse
