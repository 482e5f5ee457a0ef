// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/graph/edge_selection.h"

namespace asbuilt::graph {

/// The histogram of pairwise overlaps, updated scan by scan: for each cell the list of scans that saw it, for each
/// pair of scans the number of cells that both saw. Counts are integers, so the order of insertion never matters.
///
/// Source: Sec. 3.2, Fig. 4 (a) and (b). Cost of a scan: the lengths of the lists of its cells.
class OverlapHistogram {
 public:
  /// Adds a scan that sees `cells` (ascending, each once); gives its index, the number of scans so far.
  int insert(std::span<const VoxelKey> cells);

  [[nodiscard]] int scan_count() const { return static_cast<int>(cell_count_.size()); }
  [[nodiscard]] std::size_t cells_of(int scan) const { return cell_count_[static_cast<std::size_t>(scan)]; }

  /// All pairs that share a cell, by decreasing overlap, ties by (first, second).
  [[nodiscard]] std::vector<PairOverlap> bars() const;

 private:
  struct Shared {
    int first, second;
    std::int64_t cells;
    double firmness;
  };
  std::unordered_map<VoxelKey, std::vector<int>> seen_by_;  // looked up only, never iterated
  std::vector<std::size_t> cell_count_;
  std::vector<Shared> shared_;
};

}  // namespace asbuilt::graph
