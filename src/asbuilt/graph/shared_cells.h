// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "asbuilt/graph/covisibility.h"

namespace asbuilt::graph {

/// What two scans see both, and how well it would hold them to one another. All sums are of integers, so that they are
/// the same in any order of arrival.
class SharedCells {
 public:
  void add(const Cell& cell);

  [[nodiscard]] std::int64_t count() const;

  /// The shared cells that hold the motion (of six) that is held least: the smallest eigenvalue of the sum of J J^T,
  /// J = ((p - c) x n / r, n), c and r centre and size (rms) of the shared cells, n the cell's side. At most a third of
  /// count(). 0 for a plane, an extrusion along an axis of the model, a single cell: there is a motion that nothing
  /// shared holds. Sides know six directions only, so that a cylinder passes for a square tube: good enough to prefer
  /// one link to another, not to judge it (refine::LinkHold does).
  [[nodiscard]] double firmness() const;

 private:
  struct Moments {
    std::int64_t cells = 0;
    std::array<std::int64_t, 3> positions{};  // x, y, z
    std::array<std::int64_t, 6> products{};   // xx, xy, xz, yy, yz, zz
  };
  std::array<Moments, 3> by_axis_;  // of the normal
};

}  // namespace asbuilt::graph
