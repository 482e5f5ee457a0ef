// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/overlap_histogram.h"

#include <algorithm>

#include "asbuilt/core/result.h"

namespace asbuilt::graph {

int OverlapHistogram::insert(std::span<const VoxelKey> cells) {
  ASBUILT_EXPECT(std::ranges::adjacent_find(cells, std::ranges::greater_equal{}) == cells.end(),
                 "cells in ascending order, each once");
  const int scan = scan_count();
  std::vector<std::size_t> shared_with(static_cast<std::size_t>(scan), 0);
  for (const VoxelKey cell : cells) {
    std::vector<int>& list = seen_by_[cell];
    for (const int other : list) ++shared_with[static_cast<std::size_t>(other)];
    list.push_back(scan);
  }
  cell_count_.push_back(cells.size());
  for (int other = 0; other < scan; ++other) {
    const std::size_t count = shared_with[static_cast<std::size_t>(other)];
    if (count > 0) shared_.push_back({other, scan, count});
  }
  return scan;
}

std::vector<PairOverlap> OverlapHistogram::bars() const {
  std::vector<PairOverlap> bars;
  bars.reserve(shared_.size());
  for (const Shared& pair : shared_) {
    const std::size_t fewer = std::min(cells_of(pair.first), cells_of(pair.second));
    bars.push_back({pair.first, pair.second, static_cast<double>(pair.cells) / static_cast<double>(fewer)});
  }
  std::ranges::sort(bars, comes_before);
  return bars;
}

}  // namespace asbuilt::graph
