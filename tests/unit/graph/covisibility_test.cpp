// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/covisibility.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "asbuilt/graph/overlap_histogram.h"

namespace asbuilt::graph {
namespace {

// A patch of the plane z = height, x and y in [0, size), facing `normal`.
PointCloud patch(double x0, double size, double step, double height, const Eigen::Vector3f& normal) {
  PointCloud cloud;
  for (double x = 0.0; x < size; x += step) {
    for (double y = 0.0; y < size; y += step) {
      cloud.positions.emplace_back(static_cast<float>(x0 + x + 0.1), static_cast<float>(y + 0.1),
                                   static_cast<float>(height));
      cloud.normals.push_back(normal);
    }
  }
  return cloud;
}

const Eigen::Vector3f kUp = Eigen::Vector3f::UnitZ();
const Eigen::Vector3f kDown = -Eigen::Vector3f::UnitZ();

CovisibilityGrid grid_of_one_mm(bool by_side) { return {{Eigen::Vector3d(0, 0, -0.5), 1.0}, by_side}; }

std::size_t shared(const std::vector<VoxelKey>& a, const std::vector<VoxelKey>& b) {
  std::vector<VoxelKey> both;
  std::ranges::set_intersection(a, b, std::back_inserter(both));
  return both.size();
}

TEST(VisibleCells, CountEachVoxelWithPointsOnce) {
  const Context context(1);
  const PointCloud segment = patch(0, 4.0, 0.25, 0.0, kUp);  // 4 x 4 voxels, 16 points in each
  EXPECT_EQ(visible_cells(segment, Pose::Identity(), {}, grid_of_one_mm(false), context).size(), 16U);
}

TEST(VisibleCells, IncludeModelSamplesNearAnObservedPointThatFacesTheSameWay) {
  const Context context(1);
  const PointCloud segment = patch(0, 4.0, 0.25, 0.0, kUp);
  // The nominal surface lies 1.2 voxels above the as-built one: another layer of voxels, visible all the same.
  const PointCloud model = patch(0, 4.0, 0.25, 1.2, kUp);
  EXPECT_EQ(visible_cells(segment, Pose::Identity(), model, grid_of_one_mm(false), context).size(), 32U);
  const PointCloud back = patch(0, 4.0, 0.25, 1.2, kDown);
  EXPECT_EQ(visible_cells(segment, Pose::Identity(), back, grid_of_one_mm(false), context).size(), 16U);
  const PointCloud far = patch(0, 4.0, 0.25, 2.2, kUp);
  EXPECT_EQ(visible_cells(segment, Pose::Identity(), far, grid_of_one_mm(false), context).size(), 16U);
}

TEST(VisibleCells, TellTheTwoSidesOfAThinPlateApart) {
  const Context context(1);
  const PointCloud front = patch(0, 8.0, 0.25, 0.1, kUp), back = patch(0, 8.0, 0.25, -0.1, kDown);
  const auto cells = [&](const PointCloud& cloud, bool by_side) {
    return visible_cells(cloud, Pose::Identity(), {}, grid_of_one_mm(by_side), context);
  };
  EXPECT_EQ(shared(cells(front, true), cells(back, true)), 0U);
  EXPECT_EQ(shared(cells(front, false), cells(back, false)), 64U) << "the published grid cannot tell";
}

TEST(VisibleCells, FollowThePose) {
  const Context context(1);
  const PointCloud segment = patch(0, 4.0, 0.25, 0.0, kUp);
  Pose model_from_scan = Pose::Identity();
  model_from_scan.translation() = Eigen::Vector3d(100.0, 0.0, 0.0);
  const auto here = visible_cells(segment, Pose::Identity(), {}, grid_of_one_mm(true), context);
  const auto there = visible_cells(segment, model_from_scan, {}, grid_of_one_mm(true), context);
  EXPECT_EQ(there.size(), here.size());
  EXPECT_EQ(shared(here, there), 0U);
}

TEST(VisibleCells, OfAnEmptySegmentAreNone) {
  EXPECT_TRUE(visible_cells({}, Pose::Identity(), patch(0, 4, 1, 0, kUp), grid_of_one_mm(true), Context(1)).empty());
}

TEST(OverlapHistogram, CountsSharedCellsOverTheScanThatHasFewer) {
  OverlapHistogram histogram;
  EXPECT_EQ(histogram.insert(std::vector<VoxelKey>{1, 2, 3, 4}), 0);
  EXPECT_EQ(histogram.insert(std::vector<VoxelKey>{3, 4, 5}), 1);
  EXPECT_EQ(histogram.insert(std::vector<VoxelKey>{9}), 2);
  EXPECT_EQ(histogram.insert({}), 3);
  EXPECT_THAT(histogram.bars(), testing::ElementsAre(PairOverlap{0, 1, 2.0 / 3.0}));
  EXPECT_EQ(histogram.insert(std::vector<VoxelKey>{1, 9}), 4);
  EXPECT_THAT(histogram.bars(),
              testing::ElementsAre(PairOverlap{2, 4, 1.0}, PairOverlap{0, 1, 2.0 / 3.0}, PairOverlap{0, 4, 0.5}));
}

TEST(OverlapHistogram, InsistsOnCellsInOrder) {
  OverlapHistogram histogram;
  EXPECT_THROW(histogram.insert(std::vector<VoxelKey>{2, 1}), std::logic_error);
  EXPECT_THROW(histogram.insert(std::vector<VoxelKey>{2, 2}), std::logic_error);
}

}  // namespace
}  // namespace asbuilt::graph
