// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <random>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/graph/edge_selection.h"

namespace asbuilt::graph {
namespace {

constexpr int kScans = 12;

std::vector<PairOverlap> overlaps_with_many_ties(std::mt19937& random) {
  std::vector<PairOverlap> overlaps;
  for (int a = 0; a < kScans; ++a) {
    for (int b = a + 1; b < kScans; ++b) {
      if (random() % 3 != 0) continue;
      overlaps.push_back({a, b, static_cast<double>(random() % 11) / 20.0, static_cast<double>(random() % 4) * 8.0});
    }
  }
  return overlaps;
}

EdgeSelectionOptions random_options(std::mt19937& random) {
  EdgeSelectionOptions options;
  options.low = static_cast<double>(random() % 6) / 20.0;
  options.high = options.low + static_cast<double>(random() % 6) / 20.0;
  options.bridges_only = random() % 2 == 0;
  options.max_degree = static_cast<int>(random() % 6);
  options.enough_firm = static_cast<int>(random() % 4);
  return options;
}

// Connected components of the pairs that `use` lets through: an independent, naive reading of the definition.
template <class Use>
std::vector<int> labels(const std::vector<PairOverlap>& pairs, const Use& use) {
  std::vector<int> label(kScans);
  for (int i = 0; i < kScans; ++i) label[static_cast<std::size_t>(i)] = i;
  for (int round = 0; round < kScans; ++round) {
    for (const PairOverlap& pair : pairs) {
      if (!use(pair)) continue;
      int& a = label[static_cast<std::size_t>(pair.first)];
      int& b = label[static_cast<std::size_t>(pair.second)];
      a = b = std::min(a, b);
    }
  }
  return label;
}

std::vector<int> labels_of(const std::vector<std::vector<int>>& components) {
  std::vector<int> label(kScans, -1);
  for (const std::vector<int>& component : components) {
    for (const int scan : component) label[static_cast<std::size_t>(scan)] = component.front();
  }
  return label;
}

TEST(EdgeSelectionProperty, InputOrderNeverMatters) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::vector<PairOverlap> overlaps = overlaps_with_many_ties(random);
    const EdgeSelectionOptions options = random_options(random);
    const EdgeSelection expected = select_edges(kScans, overlaps, options).value();
    std::ranges::shuffle(overlaps, random);
    const EdgeSelection shuffled = select_edges(kScans, overlaps, options).value();
    EXPECT_EQ(shuffled.edges, expected.edges) << "seed " << seed;
    EXPECT_EQ(shuffled.components, expected.components) << "seed " << seed;
  }
}

TEST(EdgeSelectionProperty, ComponentsAreThoseOfAllPairsAboveLow) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const std::vector<PairOverlap> overlaps = overlaps_with_many_ties(random);
    const EdgeSelectionOptions options = random_options(random);
    const EdgeSelection selection = select_edges(kScans, overlaps, options).value();
    const auto allowed = [&](const PairOverlap& pair) { return pair.overlap >= options.low; };
    EXPECT_EQ(labels_of(selection.components), labels(overlaps, allowed)) << "seed " << seed;
    const auto all = [](const PairOverlap&) { return true; };
    EXPECT_EQ(labels(selection.edges, all), labels(overlaps, allowed)) << "seed " << seed;
  }
}

TEST(EdgeSelectionProperty, EveryStrongPairAndNoPairBelowLowIsLinked) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const std::vector<PairOverlap> overlaps = overlaps_with_many_ties(random);
    EdgeSelectionOptions options = random_options(random);
    options.max_degree = 0;
    const EdgeSelection selection = select_edges(kScans, overlaps, options).value();
    for (const PairOverlap& pair : overlaps) {
      const bool linked = std::ranges::count(selection.edges, pair) == 1;
      if (pair.overlap >= options.high) {
        EXPECT_TRUE(linked) << "seed " << seed;
      }
      if (pair.overlap < options.low) {
        EXPECT_FALSE(linked) << "seed " << seed;
      }
    }
  }
}

TEST(EdgeSelectionProperty, CandidatesAreAllStrongPairsWhateverTheCapAndTheOrder) {
  std::size_t capped = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    std::vector<PairOverlap> overlaps = overlaps_with_many_ties(random);
    EdgeSelectionOptions options = random_options(random);
    const auto is_strong = [&](const PairOverlap& pair) { return pair.overlap >= options.high; };
    std::vector<PairOverlap> strong;
    std::ranges::copy_if(overlaps, std::back_inserter(strong), is_strong);
    std::ranges::stable_sort(strong, std::ranges::greater{}, &PairOverlap::overlap);  // made by (first, second)
    EXPECT_TRUE(std::ranges::is_sorted(strong, comes_before)) << "seed " << seed;
    for (int draw = 0; draw < 4; ++draw) {
      const EdgeSelection selection = select_edges(kScans, overlaps, options).value();
      EXPECT_EQ(selection.candidates, strong)
          << "seed " << seed << ", max_degree " << options.max_degree << ", enough_firm " << options.enough_firm;
      if (std::ranges::count_if(selection.edges, is_strong) < std::ssize(strong)) ++capped;
      const EdgeSelectionOptions other = random_options(random);
      options.max_degree = other.max_degree;
      options.enough_firm = other.enough_firm;
      std::ranges::shuffle(overlaps, random);
    }
  }
  EXPECT_GT(capped, 100U) << "a test of caps that are at work";
}

TEST(EdgeSelectionProperty, AWeakEdgeAlwaysJoinsTwoPieces) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const std::vector<PairOverlap> overlaps = overlaps_with_many_ties(random);
    EdgeSelectionOptions options = random_options(random);
    options.bridges_only = true;
    const EdgeSelection selection = select_edges(kScans, overlaps, options).value();
    DisjointSets pieces(kScans);
    for (const PairOverlap& edge : selection.edges) {
      const bool joins = pieces.unite(edge.first, edge.second);
      EXPECT_TRUE(joins || edge.overlap >= options.high) << "seed " << seed;
    }
  }
}

TEST(EdgeSelectionProperty, TheDegreeCapThinsButNeverCuts) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const std::vector<PairOverlap> overlaps = overlaps_with_many_ties(random);
    EdgeSelectionOptions options = random_options(random);
    options.max_degree = 0;
    const EdgeSelection free = select_edges(kScans, overlaps, options).value();
    options.max_degree = 3;
    options.enough_firm = static_cast<int>(random() % 3);
    const EdgeSelection capped = select_edges(kScans, overlaps, options).value();
    EXPECT_EQ(capped.components, free.components) << "seed " << seed;
    EXPECT_LE(capped.edges.size(), free.edges.size());
    // At most a forest (one less than the scans) plus what the cap allows: 3 ends a scan, two ends an edge.
    EXPECT_LE(capped.edges.size(), static_cast<std::size_t>(kScans - 1 + 3 * kScans / 2));
  }
}

}  // namespace
}  // namespace asbuilt::graph
