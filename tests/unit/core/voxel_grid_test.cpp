// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/voxel_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <stdexcept>

namespace asbuilt {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(VoxelGrid, CellsAreCountedFromTheOriginDownwardsToo) {
  const VoxelGrid grid{Vector3d(10.0, 0.0, 0.0), 2.0};
  EXPECT_EQ(grid.cell({10.0, 0.0, 0.0}), Vector3i(0, 0, 0));
  EXPECT_EQ(grid.cell({11.9, 2.0, -0.1}), Vector3i(0, 1, -1));
  EXPECT_EQ(grid.cell({9.9, -2.0, -2.1}), Vector3i(-1, -1, -2));
}

TEST(VoxelGrid, DifferentCellsHaveDifferentKeysUpToTheEdgeOfTheRange) {
  constexpr int kEdge = 1 << 20;
  std::set<VoxelKey> keys;
  int cells = 0;
  for (const int x : {-kEdge, -1, 0, 1, kEdge - 1}) {
    for (const int y : {-kEdge, -1, 0, 1, kEdge - 1}) {
      for (const int z : {-kEdge, -1, 0, 1, kEdge - 1}) {
        keys.insert(VoxelGrid::key_of_cell({x, y, z}));
        ++cells;
      }
    }
  }
  EXPECT_EQ(keys.size(), static_cast<std::size_t>(cells));
}

TEST(VoxelGrid, KeysSortByLayerThenRowThenColumn) {
  EXPECT_LT(VoxelGrid::key_of_cell({5, 5, -1}), VoxelGrid::key_of_cell({-5, -5, 0}));
  EXPECT_LT(VoxelGrid::key_of_cell({5, -1, 0}), VoxelGrid::key_of_cell({-5, 0, 0}));
  EXPECT_LT(VoxelGrid::key_of_cell({-1, 0, 0}), VoxelGrid::key_of_cell({0, 0, 0}));
}

TEST(EvenSubset, TakesThePointNearestToTheMeanOfItsCube) {
  const std::vector<Vector3f> points{{0, 0, 0}, {0.5F, 0, 0}, {0.9F, 0, 0}, {5, 0, 0}};
  EXPECT_THAT(even_subset(points, 1.0, Context(1)), ElementsAre(1U, 3U));
}

TEST(EvenSubset, OfCoincidentPointsIsTheFirst) {
  const std::vector<Vector3f> points(10, Vector3f(1, 2, 3));
  EXPECT_THAT(even_subset(points, 0.1, Context(2)), ElementsAre(0U));
}

TEST(EvenSubset, OfNothingIsNothing) { EXPECT_THAT(even_subset({}, 1.0, Context(1)), IsEmpty()); }

TEST(EvenSubset, KeepsPointsApartHoweverFarOneOfThemStrays) {
  // A stray return far outside the range of 21-bit cells must not fold other cubes onto one another.
  std::vector<Vector3f> points;
  for (int i = 0; i < 100; ++i) points.emplace_back(static_cast<float>(i), 0.0F, 0.0F);
  for (const float stray : {3e6F, -3e6F, 3e15F, -3e30F}) {
    points.emplace_back(0.0F, stray, 0.0F);
    EXPECT_EQ(even_subset(points, 1.0, Context(1)).size(), 101U) << stray;
    points.pop_back();
  }
}

TEST(EvenSubset, RefusesASpacingThatIsNotPositive) {
  const std::vector<Vector3f> points{{0, 0, 0}};
  for (const double spacing : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_THROW((void)even_subset(points, spacing, Context(1)), std::logic_error);
  }
}

TEST(MedianSpacing, OfASquareGridIsItsPitch) {
  std::vector<Vector3f> points;
  for (int x = 0; x < 40; ++x) {
    for (int y = 0; y < 40; ++y)
      points.emplace_back(0.25F * static_cast<float>(x), 0.25F * static_cast<float>(y), 0.0F);
  }
  EXPECT_DOUBLE_EQ(median_spacing(points), 0.25);
  EXPECT_DOUBLE_EQ(median_spacing(points, 10), 0.25);
  EXPECT_DOUBLE_EQ(median_spacing(points, 1), 0.25);
}

TEST(MedianSpacing, OfFewerThanTwoPointsIsZero) {
  EXPECT_EQ(median_spacing({}), 0.0);
  EXPECT_EQ(median_spacing(std::vector<Vector3f>{{1, 1, 1}}), 0.0);
}

TEST(MedianSpacing, RefusesToLookAtNoPoint) {
  const std::vector<Vector3f> points{{0, 0, 0}, {1, 0, 0}};
  EXPECT_THROW((void)median_spacing(points, 0), std::logic_error);
}

}  // namespace
}  // namespace asbuilt
