// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt::graph {

/// One bar of the histogram of pairwise overlaps.
struct PairOverlap {
  int first = 0, second = 0;  ///< scan indices, first < second
  double overlap = 0.0;       ///< shared voxels / voxels of the scan that has fewer, in [0, 1]
  double firmness = 0.0;      ///< shared voxels that hold the motion held least (SharedCells::firmness); 0: unknown

  bool operator==(const PairOverlap&) const = default;
};

struct EdgeSelectionOptions {
  double low = 0.05;         ///< alpha_l: a pair below it is never linked (our value; the paper gives none)
  double high = 0.10;        ///< alpha_h: a pair at or above it is always linked (likewise; docs/graph.md)
  int max_degree = 12;       ///< strong links a scan keeps in dense networks, firmest first; 0: all (docs/graph.md)
  bool bridges_only = true;  ///< below `high` only a pair that joins two components; paper: any, until connected
  int enough_firm = 4;       ///< firm links that are enough where pairs exceed the cap; 0: never (docs/graph.md)

  [[nodiscard]] Result<void> validate() const;  ///< 0 <= low <= high <= 1, max_degree >= 0, enough_firm >= 0
};

template <class Visitor>
void for_each_field(EdgeSelectionOptions& options, Visitor&& field) {
  field("low", options.low, "overlap below which two scans are never linked");
  field("high", options.high, "overlap from which they always are");
  field("max_degree", options.max_degree, "links a scan keeps in a dense network (0: all)");
  field("enough_firm", options.enough_firm,
        "firm links with which a scan with more pairs than that needs no more (0: up to the cap)");
}

struct EdgeSelection {
  std::vector<PairOverlap> edges;            ///< by decreasing overlap, ties by (first, second)
  std::vector<PairOverlap> candidates;       ///< at or above `high`: all of them links but for the cap; same order
  std::vector<std::vector<int>> components;  ///< largest first; `refine` works on the first
};

/// Decides which scans are registered to one another, by hysteresis on their overlap.
///
/// Pairs at or above `high` are linked at once. While the graph is still in pieces, further pairs follow in
/// decreasing order, down to `low`: each that joins two components, or (paper: `bridges_only` off) each at all.
/// Scans that stay alone form components of their own. With `max_degree`, one spanning forest of strong pairs after the
/// other is taken, firmest pairs first (ties by overlap, then by index), as long as both scans of a pair have room and
/// one of them needs it: a scan with more strong pairs than `max_degree` needs no further ones after `enough_firm` firm
/// ones (ten shared cells hold the motion held least), but to scans that no chain of firm pairs leads to. The first
/// forest takes no notice of that, so components never depend on it; the next ones make that no few links carry the
/// whole, which the firmest pairs alone, near twins all, would not.
///
/// Source: Sec. 3.2, Fig. 4 (c) and (d). Cost: O(P (log P + max_degree)) for P pairs.
/// Errors: invalid_argument if the options fail validate(), or a pair names an unknown scan, comes twice or has no
/// overlap in [0, 1].
[[nodiscard]] Result<EdgeSelection> select_edges(int scan_count, std::span<const PairOverlap> overlaps,
                                                 const EdgeSelectionOptions& options = {});

/// By decreasing overlap, ties by (first, second): a total order, so that it never matters how the input was ordered.
[[nodiscard]] bool comes_before(const PairOverlap& a, const PairOverlap& b);

}  // namespace asbuilt::graph
