// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/overlap_histogram.h"

#include <algorithm>

#include "asbuilt/core/result.h"
#include "asbuilt/graph/covisibility.h"
#include "asbuilt/graph/shared_cells.h"

namespace asbuilt::graph {

int OverlapHistogram::insert(std::span<const VoxelKey> cells) {
  ASBUILT_EXPECT(std::ranges::adjacent_find(cells, std::ranges::greater_equal{}) == cells.end(),
                 "cells in ascending order, each once");
  const int scan = scan_count();
  std::vector<SharedCells> shared_with(static_cast<std::size_t>(scan));
  for (const VoxelKey key : cells) {
    std::vector<int>& list = seen_by_[key];
    const Cell cell = cell_of(key);
    for (const int other : list) shared_with[static_cast<std::size_t>(other)].add(cell);
    list.push_back(scan);
  }
  cell_count_.push_back(cells.size());
  for (int other = 0; other < scan; ++other) {
    const SharedCells& shared = shared_with[static_cast<std::size_t>(other)];
    if (shared.count() > 0) shared_.push_back({other, scan, shared.count(), shared.firmness()});
  }
  return scan;
}

std::vector<PairOverlap> OverlapHistogram::bars() const {
  std::vector<PairOverlap> bars;
  bars.reserve(shared_.size());
  for (const Shared& pair : shared_) {
    const std::size_t fewer = std::min(cells_of(pair.first), cells_of(pair.second));
    bars.push_back(
        {pair.first, pair.second, static_cast<double>(pair.cells) / static_cast<double>(fewer), pair.firmness});
  }
  std::ranges::sort(bars, comes_before);
  return bars;
}

}  // namespace asbuilt::graph
