// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/edge_selection.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

namespace asbuilt::graph {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(EdgeSelection, WeakPairsAreUsedOnlyUntilTheGraphIsConnected) {
  const std::vector<PairOverlap> overlaps{{0, 1, 0.8}, {1, 2, 0.2}, {0, 2, 0.15}};
  const EdgeSelectionOptions options{0.1, 0.3, 0, true};
  const EdgeSelection selection = select_edges(3, overlaps, options).value();
  EXPECT_THAT(selection.edges, ElementsAre(PairOverlap{0, 1, 0.8}, PairOverlap{1, 2, 0.2}));
  EXPECT_THAT(selection.components, ElementsAre(ElementsAre(0, 1, 2)));
}

TEST(EdgeSelection, StrongPairsAreAllLinkedEvenWhenNoneIsNeeded) {
  const std::vector<PairOverlap> overlaps{{0, 1, 0.8}, {0, 2, 0.7}, {1, 2, 0.35}};
  EXPECT_EQ(select_edges(3, overlaps).value().edges.size(), 3U);
}

TEST(EdgeSelection, AWeakPairInsideAComponentIsTakenInPaperModeOnly) {
  // 0-1-2 strong; 0-2 weak but stronger than 2-3, which alone connects scan 3.
  const std::vector<PairOverlap> overlaps{{0, 1, 0.8}, {1, 2, 0.6}, {0, 2, 0.3}, {2, 3, 0.2}, {0, 3, 0.15}};
  EdgeSelectionOptions ours;
  ours.high = 0.35;
  EdgeSelectionOptions paper = ours;
  paper.bridges_only = false;
  EXPECT_THAT(
      select_edges(4, overlaps, paper).value().edges,
      ElementsAre(PairOverlap{0, 1, 0.8}, PairOverlap{1, 2, 0.6}, PairOverlap{0, 2, 0.3}, PairOverlap{2, 3, 0.2}));
  EXPECT_THAT(select_edges(4, overlaps, ours).value().edges,
              ElementsAre(PairOverlap{0, 1, 0.8}, PairOverlap{1, 2, 0.6}, PairOverlap{2, 3, 0.2}));
}

TEST(EdgeSelection, ThresholdsThemselvesAreInclusive) {
  const EdgeSelectionOptions options{0.2, 0.5, 0, true};
  EXPECT_THAT(select_edges(2, std::vector<PairOverlap>{{0, 1, 0.2}}, options).value().edges, testing::SizeIs(1));
  EXPECT_THAT(select_edges(2, std::vector<PairOverlap>{{0, 1, std::nextafter(0.2, 0.0)}}, options).value().edges,
              IsEmpty());
}

TEST(EdgeSelection, ScansWithoutLinksFormComponentsOfTheirOwn) {
  const std::vector<PairOverlap> overlaps{{1, 3, 0.9}, {0, 2, 0.04}};
  const EdgeSelection selection = select_edges(4, overlaps).value();
  EXPECT_THAT(selection.components, ElementsAre(ElementsAre(1, 3), ElementsAre(0), ElementsAre(2)));
}

TEST(EdgeSelection, UnderTheCapTheFirmestPairStaysNotTheOneThatOverlapsMost) {
  // A ring of four that needs three links; at a cap of one nothing follows the forest of the firmest.
  const std::vector<PairOverlap> overlaps{{0, 1, 0.9, 0.0}, {1, 2, 0.8, 5.0}, {2, 3, 0.7, 6.0}, {0, 3, 0.6, 7.0}};
  EdgeSelectionOptions options;
  options.max_degree = 1;
  EXPECT_THAT(select_edges(4, overlaps, options).value().edges, ElementsAre(overlaps[1], overlaps[2], overlaps[3]));
}

TEST(EdgeSelection, UnderTheCapTwoCrowdsAreTiedByMoreThanOneLink) {
  // Two crowds of six near twins; the pairs across are less firm than any within.
  std::vector<PairOverlap> overlaps;
  for (int a = 0; a < 12; ++a) {
    for (int b = a + 1; b < 12; ++b) {
      const bool across = a < 6 && b >= 6;
      overlaps.push_back({a, b, across ? 0.3 : 0.9, across ? 2.0 : 9.0});
    }
  }
  EdgeSelectionOptions options;
  options.max_degree = 5;
  const EdgeSelection selection = select_edges(12, overlaps, options).value();
  EXPECT_LE(selection.edges.size(), 12U * 5U / 2U + 11U);
  const auto across = std::ranges::count_if(selection.edges, [](const PairOverlap& p) { return p.overlap < 0.5; });
  EXPECT_GE(across, 2);
}

TEST(EdgeSelection, ByDefaultLinksGrowWithTheScansAndNotWithTheirPairs) {
  const auto links_of = [](int scans) {
    std::vector<PairOverlap> overlaps;
    for (int a = 0; a < scans; ++a) {
      for (int b = a + 1; b < scans; ++b) overlaps.push_back({a, b, 0.5, 1.0 / (1.0 + b - a)});
    }
    const EdgeSelection selection = select_edges(scans, overlaps).value();
    EXPECT_THAT(selection.components, testing::SizeIs(1));
    return selection.edges.size();
  };
  EXPECT_EQ(links_of(13), 13U * 12U / 2U) << "so few lose none";
  EXPECT_LE(links_of(200), 200U * 12U / 2U + 199U) << "the cap, and the forest that takes no notice of it";
}

// Every pair of `scans` overlaps by a half, with the firmness that `of` gives.
template <class Firmness>
std::vector<PairOverlap> all_pairs(int scans, const Firmness& of) {
  std::vector<PairOverlap> overlaps;
  for (int a = 0; a < scans; ++a) {
    for (int b = a + 1; b < scans; ++b) overlaps.push_back({a, b, 0.5, of(a, b)});
  }
  return overlaps;
}

std::vector<int> links_of_each(int scans, const EdgeSelection& selection) {
  std::vector<int> links(static_cast<std::size_t>(scans), 0);
  for (const PairOverlap& edge : selection.edges) {
    ++links[static_cast<std::size_t>(edge.first)];
    ++links[static_cast<std::size_t>(edge.second)];
  }
  return links;
}

TEST(EdgeSelection, ADenseNetworkOfFirmLinksNeedsFewAndOneOfLooseLinksTheWholeCap) {
  constexpr int kMany = 60;
  const auto links_each = [](double firmness) {
    const auto pairs = all_pairs(kMany, [&](int a, int b) { return firmness / (1.0 + 0.01 * (b - a)); });
    return 2.0 * static_cast<double>(select_edges(kMany, pairs).value().edges.size()) / kMany;
  };
  EXPECT_GE(links_each(100.0), 4.0);
  EXPECT_LE(links_each(100.0), 8.0);
  EXPECT_GE(links_each(1.0), 11.0);
  EXPECT_LE(links_each(1.0), 14.0) << "the cap, and the forest that takes no notice of it";
}

TEST(EdgeSelection, AScanThatNoLinkHoldsFirmlyKeepsMoreAmongScansThatAreHeld) {
  constexpr int kMany = 40, kLoose = 7;
  const auto pairs = all_pairs(kMany, [](int a, int b) { return a == kLoose || b == kLoose ? 2.0 : 80.0; });
  const EdgeSelection selection = select_edges(kMany, pairs).value();
  EXPECT_EQ(links_of_each(kMany, selection)[kLoose], EdgeSelectionOptions{}.max_degree);
  EXPECT_LE(selection.edges.size(), 4U * kMany) << "the others stay at some four to eight";
}

TEST(EdgeSelection, TwoFirmCrowdsAreTiedByAsManyLooseLinksAsTheCapAllows) {
  constexpr int kCrowd = 20;
  const auto across = [](const PairOverlap& pair) { return pair.first < kCrowd && pair.second >= kCrowd; };
  const auto pairs = all_pairs(2 * kCrowd, [&](int a, int b) {
    return across({a, b}) ? 2.0 : 100.0 / (1.0 + 0.01 * (b - a));
  });
  const EdgeSelection selection = select_edges(2 * kCrowd, pairs).value();
  const auto ties = std::ranges::count_if(selection.edges, across);
  EXPECT_GE(ties, 8);
  EXPECT_LE(static_cast<std::ptrdiff_t>(selection.edges.size()) - ties, 2 * kCrowd * 4) << "within, few are enough";
}

TEST(EdgeSelection, EnoughFirmLinksAreCountedOnlyWhereTheCapIsAtWork) {
  const auto pairs = all_pairs(13, [](int, int) { return 100.0; });  // 12 pairs a scan: none too many
  EXPECT_EQ(select_edges(13, pairs).value().edges.size(), pairs.size());
  EdgeSelectionOptions options;
  options.enough_firm = 0;
  const auto many = all_pairs(40, [](int, int) { return 100.0; });
  EXPECT_GE(select_edges(40, many, options).value().edges.size(), 40U * 11U / 2U) << "0: up to the cap";
  options.max_degree = 0;
  options.enough_firm = 4;
  EXPECT_EQ(select_edges(40, many, options).value().edges.size(), many.size()) << "no cap, no choice";
}

TEST(EdgeSelection, NothingGivesNothing) {
  const EdgeSelection selection = select_edges(0, {}).value();
  EXPECT_THAT(selection.edges, IsEmpty());
  EXPECT_THAT(selection.components, IsEmpty());
}

TEST(EdgeSelection, ImpossibleOverlapsAreRefusedWithTheirNumbers) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const PairOverlap& bad :
       {PairOverlap{0, 1, 1.5}, PairOverlap{0, 1, -0.1}, PairOverlap{0, 1, nan}, PairOverlap{1, 0, 0.5},
        PairOverlap{0, 0, 0.5}, PairOverlap{0, 3, 0.5}, PairOverlap{-1, 1, 0.5}}) {
    const auto result = select_edges(3, std::vector<PairOverlap>{bad});
    ASSERT_FALSE(result.has_value());
    EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
    EXPECT_THAT(result.error().message, HasSubstr("among 3 scans"));
  }
  EXPECT_THAT(select_edges(3, std::vector<PairOverlap>{{0, 1, 0.5}, {0, 1, 0.4}}).error().message, HasSubstr("twice"));
}

TEST(EdgeSelection, OptionsOutOfOrderAreRefused) {
  EXPECT_FALSE((EdgeSelectionOptions{0.5, 0.4, 0, true}).validate());
  EXPECT_FALSE((EdgeSelectionOptions{-0.1, 0.4, 0, true}).validate());
  EXPECT_FALSE((EdgeSelectionOptions{0.1, 1.1, 0, true}).validate());
  EXPECT_FALSE((EdgeSelectionOptions{std::numeric_limits<double>::quiet_NaN(), 0.4, 0, true}).validate());
  EXPECT_FALSE((EdgeSelectionOptions{0.1, 0.4, -1, true}).validate());
  EXPECT_FALSE((EdgeSelectionOptions{0.1, 0.4, 0, true, -1}).validate());
  EXPECT_TRUE(EdgeSelectionOptions{}.validate());
}

}  // namespace
}  // namespace asbuilt::graph
