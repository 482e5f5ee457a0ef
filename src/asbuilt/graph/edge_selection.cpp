// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/edge_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <tuple>
#include <utility>

#include "asbuilt/core/disjoint_sets.h"

namespace asbuilt::graph {
namespace {

bool is_valid(const PairOverlap& pair, int scan_count) {
  const bool scans_exist = 0 <= pair.first && pair.first < pair.second && pair.second < scan_count;
  if (std::isnan(pair.firmness)) return false;
  return scans_exist && 0.0 <= pair.overlap && pair.overlap <= 1.0;  // NaN fails here, as it should
}

Result<void> check(int scan_count, std::span<const PairOverlap> overlaps) {
  for (const PairOverlap& pair : overlaps) {
    if (is_valid(pair, scan_count)) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("overlap {} of scans {} and {} among {} scans is impossible",
                                                         pair.overlap, pair.first, pair.second, scan_count));
  }
  std::vector<std::pair<int, int>> pairs;
  for (const PairOverlap& pair : overlaps) pairs.emplace_back(pair.first, pair.second);
  std::ranges::sort(pairs);
  if (const auto twice = std::ranges::adjacent_find(pairs); twice != pairs.end()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("the overlap of scans {} and {} is given twice", twice->first, twice->second));
  }
  return {};
}

constexpr double kFirm = 10.0;  // shared cells that hold the motion held least

// The strong pairs of a scan, and those of them that were taken so far.
struct LinksOfScan {
  int pairs = 0, taken = 0, firm = 0;
};

// Which of the strong pairs stay under the cap: one forest after the other, each from the firmest pairs that are left.
std::vector<bool> under_cap(int scan_count, std::span<const PairOverlap> strong, const EdgeSelectionOptions& options) {
  std::vector<bool> kept(strong.size(), options.max_degree == 0);
  if (options.max_degree == 0) return kept;
  std::vector<std::size_t> waiting(strong.size());
  std::iota(waiting.begin(), waiting.end(), std::size_t{0});
  std::ranges::stable_sort(waiting, std::ranges::greater{}, [&](std::size_t i) { return strong[i].firmness; });

  std::vector<LinksOfScan> scans(static_cast<std::size_t>(scan_count));
  DisjointSets firmly(scan_count);  // groups that firm pairs hold together
  for (const PairOverlap& pair : strong) {
    ++scans[static_cast<std::size_t>(pair.first)].pairs;
    ++scans[static_cast<std::size_t>(pair.second)].pairs;
    if (pair.firmness >= kFirm) firmly.unite(pair.first, pair.second);
  }
  const auto has_room = [&](const LinksOfScan& scan) { return scan.taken < options.max_degree; };
  const auto has_enough = [&](const LinksOfScan& scan) {
    return options.enough_firm > 0 && scan.pairs > options.max_degree && scan.firm >= options.enough_firm;
  };
  for (bool first = true; !waiting.empty(); first = false) {
    DisjointSets forest(scan_count);
    std::vector<std::size_t> left;
    for (const std::size_t i : waiting) {
      const PairOverlap& pair = strong[i];
      LinksOfScan& one = scans[static_cast<std::size_t>(pair.first)];
      LinksOfScan& other = scans[static_cast<std::size_t>(pair.second)];
      // Between two groups no pair is firm: as many tie them as the cap allows.
      const bool needed =
          !(has_enough(one) && has_enough(other)) || firmly.find(pair.first) != firmly.find(pair.second);
      const bool wanted = needed && has_room(one) && has_room(other);
      if (!first && !wanted) continue;  // nor will it ever be
      if (!forest.unite(pair.first, pair.second)) {
        left.push_back(i);
        continue;
      }
      kept[i] = true;
      for (LinksOfScan* scan : {&one, &other}) {
        ++scan->taken;
        if (pair.firmness >= kFirm) ++scan->firm;
      }
    }
    waiting = std::move(left);
  }
  return kept;
}

}  // namespace

bool comes_before(const PairOverlap& a, const PairOverlap& b) {
  return std::tuple(-a.overlap, a.first, a.second) < std::tuple(-b.overlap, b.first, b.second);
}

Result<void> EdgeSelectionOptions::validate() const {
  if (!(0.0 <= low && low <= high && high <= 1.0)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("overlap thresholds low = {} and high = {} must satisfy 0 <= low <= high <= 1", low, high));
  }
  if (max_degree < 0) {
    return fail(ErrorCode::invalid_argument, fmt::format("max_degree = {} must not be negative", max_degree));
  }
  if (enough_firm < 0) {
    return fail(ErrorCode::invalid_argument, fmt::format("enough_firm = {} must not be negative", enough_firm));
  }
  return {};
}

Result<EdgeSelection> select_edges(int scan_count, std::span<const PairOverlap> overlaps,
                                   const EdgeSelectionOptions& options) {
  ASBUILT_CHECK(options.validate());
  ASBUILT_CHECK(check(scan_count, overlaps));

  std::vector<PairOverlap> ranked(overlaps.begin(), overlaps.end());
  std::ranges::sort(ranked, comes_before);
  const auto strong_end = std::ranges::find_if(ranked, [&](const auto& pair) { return pair.overlap < options.high; });
  const std::span<const PairOverlap> strong(ranked.begin(), strong_end);

  EdgeSelection selection;
  selection.candidates.assign(strong.begin(), strong.end());
  DisjointSets linked(scan_count);
  const std::vector<bool> kept = under_cap(scan_count, strong, options);
  for (std::size_t i = 0; i < strong.size(); ++i) {
    if (!kept[i]) continue;
    linked.unite(strong[i].first, strong[i].second);
    selection.edges.push_back(strong[i]);
  }
  for (const PairOverlap& pair : std::span<const PairOverlap>(strong_end, ranked.end())) {
    const bool still_needed = linked.count() > 1 && pair.overlap >= options.low;
    if (!still_needed) break;
    const bool joins = linked.unite(pair.first, pair.second);
    if (joins || !options.bridges_only) selection.edges.push_back(pair);
  }
  selection.components = linked.by_decreasing_size();
  return selection;
}

}  // namespace asbuilt::graph
