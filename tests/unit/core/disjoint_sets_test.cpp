// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/disjoint_sets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace asbuilt {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(DisjointSets, StartWithEveryElementAlone) {
  DisjointSets sets(3);
  EXPECT_EQ(sets.count(), 3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(sets.find(i), i);
}

TEST(DisjointSets, UniteTellsWhetherAnythingChanged) {
  DisjointSets sets(4);
  EXPECT_TRUE(sets.unite(0, 1));
  EXPECT_TRUE(sets.unite(1, 2));
  EXPECT_FALSE(sets.unite(2, 0));
  EXPECT_FALSE(sets.unite(3, 3));
  EXPECT_EQ(sets.count(), 2);
}

TEST(DisjointSets, SmallestMemberStandsForTheSet) {
  DisjointSets sets(6);
  sets.unite(5, 4);
  sets.unite(3, 5);
  EXPECT_EQ(sets.find(5), 3);
  EXPECT_EQ(sets.find(4), 3);
}

TEST(DisjointSets, AnElementCanBeAddedBetweenUnions) {
  DisjointSets sets;
  EXPECT_EQ(sets.add(), 0);
  EXPECT_EQ(sets.add(), 1);
  sets.unite(1, 0);
  EXPECT_EQ(sets.add(), 2);
  EXPECT_EQ(sets.count(), 2);
  EXPECT_EQ(sets.size(), 3);
  EXPECT_EQ(sets.find(2), 2);
}

TEST(DisjointSets, AreListedLargestFirstAndThenBySmallestMember) {
  DisjointSets sets(7);
  sets.unite(6, 4);
  sets.unite(4, 2);
  sets.unite(5, 3);
  sets.unite(1, 0);
  EXPECT_THAT(sets.by_decreasing_size(), ElementsAre(ElementsAre(2, 4, 6), ElementsAre(0, 1), ElementsAre(3, 5)));
}

TEST(DisjointSets, OfNothingAreNoSets) { EXPECT_THAT(DisjointSets(0).by_decreasing_size(), IsEmpty()); }

}  // namespace
}  // namespace asbuilt
