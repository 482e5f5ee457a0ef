// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/kd_tree.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace asbuilt {
namespace {

using Eigen::Vector3f;
using Neighbours = std::vector<KdTree::Neighbour>;
using testing::ElementsAre;

std::vector<std::uint32_t> indices(const Neighbours& neighbours) {
  std::vector<std::uint32_t> result;
  for (const auto& neighbour : neighbours) result.push_back(neighbour.index);
  return result;
}

TEST(KdTree, OfNothingFindsNothing) {
  const KdTree tree(std::span<const Vector3f>{});
  Neighbours neighbours{{7, 1.0F}};
  EXPECT_EQ(tree.size(), 0U);
  EXPECT_FALSE(tree.nearest(Vector3f::Zero()).found());
  tree.nearest(Vector3f::Zero(), 3, neighbours);
  EXPECT_TRUE(neighbours.empty());
  neighbours = {{7, 1.0F}};
  tree.within(Vector3f::Zero(), 1.0F, neighbours);
  EXPECT_TRUE(neighbours.empty());
}

TEST(KdTree, OfOnePointFindsIt) {
  const std::vector<Vector3f> points{{1, 2, 3}};
  const KdTree tree(points);
  const auto found = tree.nearest({1, 2, 5});
  EXPECT_EQ(found.index, 0U);
  EXPECT_EQ(found.squared_distance, 4.0F);
}

TEST(KdTree, ReachIncludesItsBorder) {
  const std::vector<Vector3f> points{{3, 4, 0}};
  const KdTree tree(points);
  EXPECT_TRUE(tree.nearest(Vector3f::Zero(), 5.0F).found());
  EXPECT_FALSE(tree.nearest(Vector3f::Zero(), std::nextafter(5.0F, 0.0F)).found());
  Neighbours neighbours;
  tree.within(Vector3f::Zero(), 5.0F, neighbours);
  EXPECT_THAT(indices(neighbours), ElementsAre(0U));
}

TEST(KdTree, ReachOfZeroFindsAPointAtTheQueryItself) {
  const std::vector<Vector3f> points{{0, 0, 1}, {1, 1, 1}};
  EXPECT_EQ(KdTree(points).nearest({1, 1, 1}, 0.0F).index, 1U);
}

TEST(KdTree, GivesATieToTheLowerIndex) {
  // 200 copies of the same six corners of an octahedron: every distance is tied many times over, across leaves.
  std::vector<Vector3f> points;
  for (int copy = 0; copy < 200; ++copy) {
    for (int axis = 0; axis < 3; ++axis) {
      points.push_back(-Vector3f::Unit(axis));
      points.push_back(Vector3f::Unit(axis));
    }
  }
  const KdTree tree(points);
  EXPECT_EQ(tree.nearest(Vector3f::Zero()).index, 0U);
  Neighbours neighbours;
  tree.nearest(Vector3f::Zero(), 5, neighbours);
  EXPECT_THAT(indices(neighbours), ElementsAre(0U, 1U, 2U, 3U, 4U));
}

TEST(KdTree, GivesFewerThanAskedWhenThereAreFewer) {
  const std::vector<Vector3f> points{{2, 0, 0}, {1, 0, 0}};
  Neighbours neighbours;
  KdTree(points).nearest(Vector3f::Zero(), 9, neighbours);
  EXPECT_THAT(indices(neighbours), ElementsAre(1U, 0U));
  KdTree(points).nearest(Vector3f::Zero(), 0, neighbours);
  EXPECT_TRUE(neighbours.empty());
}

TEST(KdTree, SkipsNearerPointsThatFaceElsewhere) {
  const std::vector<Vector3f> points{{1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  const std::vector<Vector3f> directions{-Vector3f::UnitZ(), Vector3f::UnitZ(), Vector3f::UnitZ()};
  const KdTree tree(points);
  EXPECT_EQ(tree.nearest_facing(Vector3f::Zero(), 10.0F, directions, Vector3f::UnitZ(), 0.5F).index, 1U);
  EXPECT_FALSE(tree.nearest_facing(Vector3f::Zero(), 1.5F, directions, Vector3f::UnitZ(), 0.5F).found());
  EXPECT_FALSE(tree.nearest_facing(Vector3f::Zero(), 10.0F, directions, Vector3f::UnitX(), 0.5F).found());
}

TEST(KdTree, FacingNeedsMoreThanTheCosineGiven) {
  const std::vector<Vector3f> points{{1, 0, 0}};
  const std::vector<Vector3f> directions{Vector3f::UnitX()};
  EXPECT_FALSE(KdTree(points).nearest_facing(Vector3f::Zero(), 2.0F, directions, Vector3f::UnitX(), 1.0F).found());
}

TEST(KdTree, KeepsItsPointsWhenMoved) {
  std::vector<Vector3f> points{{0, 0, 0}, {5, 0, 0}};
  KdTree first(points);
  points.clear();
  const KdTree second = std::move(first);
  EXPECT_EQ(second.nearest({4, 0, 0}).index, 1U);
}

}  // namespace
}  // namespace asbuilt
