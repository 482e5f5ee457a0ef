// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::fuse {

/// Points sorted into cubes: millions of neighbourhood queries of one radius, without a tree.
class PointGrid {
 public:
  /// `cell_mm` is the largest radius that can be asked for.
  PointGrid(std::span<const Eigen::Vector3f> points, double cell_mm, const Context& context);

  /// Calls visit(index) for every point in the 27 cubes around `centre`, in a fixed order, until it says true: enough.
  template <class Visit>
  void around_until(const Eigen::Vector3f& centre, const Visit& visit) const {
    for_each_row(centre, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        if (visit(order_[i])) return true;
      }
      return false;
    });
  }

  /// Calls visit(index) for every point in the 27 cubes around `centre` that lies no further than `radius` from the
  /// line through `centre` along the unit vector `direction`, in a fixed order, until it says true. Only the grid's own
  /// sorted copy of the positions is read to decide that: where noise is large against the spacing, the cubes hold far
  /// more points than the line has near it.
  template <class Visit>
  void along(const Eigen::Vector3f& centre, const Eigen::Vector3f& direction, float radius, const Visit& visit) const {
    const float limit = radius * radius;
    for_each_row(centre, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector3f offset = positions_[i] - centre;
        const float along = offset.dot(direction);
        if (offset.squaredNorm() - along * along <= limit && visit(order_[i])) return true;
      }
      return false;
    });
  }

 private:
  // Calls use(begin, end) with the range of order_ that each of the nine rows of three cubes takes, until it says true.
  template <class Use>
  void for_each_row(const Eigen::Vector3f& centre, const Use& use) const {
    const Eigen::Vector3i cell = grid_.cell(centre.cast<double>());
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        // Cubes in a row along x have consecutive keys, so their points are one range.
        const auto [begin, end] = points_between(VoxelGrid::key_of_cell(cell + Eigen::Vector3i(-1, y, z)),
                                                 VoxelGrid::key_of_cell(cell + Eigen::Vector3i(1, y, z)));
        if (use(begin, end)) return;
      }
    }
  }

  [[nodiscard]] std::pair<std::size_t, std::size_t> points_between(VoxelKey first, VoxelKey last) const;

  VoxelGrid grid_;
  std::vector<std::uint32_t> order_;        // point indices by (cube, index)
  std::vector<Eigen::Vector3f> positions_;  // in that order
  std::vector<VoxelKey> keys_;              // occupied cubes, ascending
  std::vector<std::size_t> starts_;         // of each cube in order_; one more at the end
};

}  // namespace asbuilt::fuse
