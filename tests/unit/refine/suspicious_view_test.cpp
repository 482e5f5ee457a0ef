// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/suspicious_view.h"

#include <gmock/gmock.h>

#include <vector>

namespace asbuilt::refine {
namespace {

// All pairs of `views`, both ways, with a spread of 0.1 mm, except those of `wrong`, which have `spread`.
std::vector<EdgeResidual> complete_graph(int views, int wrong, double spread) {
  std::vector<EdgeResidual> edges;
  for (int a = 0; a < views; ++a) {
    for (int b = 0; b < views; ++b) {
      if (a == b) continue;
      EdgeResidual edge;
      edge.first = a;
      edge.second = b;
      edge.candidates = 500;
      edge.spread_mm = (a == wrong || b == wrong) ? spread : 0.1;
      edges.push_back(edge);
    }
  }
  return edges;
}

TEST(SuspiciousView, IsTheOneWhoseEveryEdgeIsMuchWorse) {
  const auto found = suspicious_view(5, complete_graph(5, 3, 1.0));
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->view, 3);
  EXPECT_DOUBLE_EQ(found->spread_mm, 1.0);
  EXPECT_DOUBLE_EQ(found->others_spread_mm, 0.1);
}

TEST(SuspiciousView, IsNobodyWhenAllAgree) { EXPECT_FALSE(suspicious_view(5, complete_graph(5, -1, 0.0))); }

TEST(SuspiciousView, NeedsThreeOthersThatAgree) {
  EXPECT_FALSE(suspicious_view(3, complete_graph(3, 1, 5.0)));
  EXPECT_TRUE(suspicious_view(4, complete_graph(4, 1, 5.0)));
}

TEST(SuspiciousView, NeedsClearEvidence) { EXPECT_FALSE(suspicious_view(6, complete_graph(6, 2, 0.25))); }

TEST(SuspiciousView, IsClearedByOneGoodEdge) {
  auto edges = complete_graph(5, 3, 1.0);
  for (EdgeResidual& edge : edges) {
    if (edge.first == 3 && edge.second == 0) edge.spread_mm = 0.1;
  }
  EXPECT_FALSE(suspicious_view(5, edges));
}

TEST(SuspiciousView, IsNotJudgedByEdgesWithHardlyAnyPoints) {
  auto edges = complete_graph(5, 3, 1.0);
  for (EdgeResidual& edge : edges) {
    if (edge.first == 3 || edge.second == 3) edge.candidates = 10;
  }
  EXPECT_FALSE(suspicious_view(5, edges));
}

TEST(SuspiciousView, IsNotNamedForDifferencesBelowTheFloor) {
  EXPECT_TRUE(suspicious_view(5, complete_graph(5, 3, 1.0), 0.1));
  EXPECT_FALSE(suspicious_view(5, complete_graph(5, 3, 1.0), 1.0));
}

TEST(SuspiciousView, OfTwoAmongTwelveIsFirstTheWorseAndThenTheOther) {
  auto edges = complete_graph(12, 3, 5.0);
  for (EdgeResidual& edge : edges) {
    const bool of_worse = edge.first == 3 || edge.second == 3;
    if (!of_worse && (edge.first == 8 || edge.second == 8)) edge.spread_mm = 1.0;
  }
  std::vector<int> named;
  while (const auto found = suspicious_view(12, edges)) {
    const int view = found->view;
    named.push_back(view);
    std::erase_if(edges, [&](const EdgeResidual& edge) { return edge.first == view || edge.second == view; });
  }
  EXPECT_THAT(named, testing::ElementsAre(3, 8));
}

TEST(SuspiciousView, OfAnEmptyGraphIsNobody) {
  EXPECT_FALSE(suspicious_view(0, {}));
  EXPECT_FALSE(suspicious_view(4, {}));
}

}  // namespace
}  // namespace asbuilt::refine
