// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/viewpoint_search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stop_token>

#include "asbuilt/core/pose.h"
#include "asbuilt/scan/scan.h"
#include "unit/scan/camera.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

Scan prepared_points(std::vector<Eigen::Vector3f> points, const ViewpointRequest& request = {}) {
  PointCloud raw;
  raw.positions = std::move(points);
  return prepare_scan(raw, std::nullopt, request, {}, Context(2)).value();
}

std::vector<Eigen::Vector3f> moved(std::vector<Eigen::Vector3f> points, const Pose& motion) {
  for (Eigen::Vector3f& point : points) point = (motion * point.cast<double>()).cast<float>();
  return points;
}

TEST(ViewpointSearch, FindsTheCameraInAnyFrame) {
  const auto points = test::seen_by_camera(test::kCamera);
  const Eigen::AngleAxisd turns[] = {{0.0, Eigen::Vector3d::UnitX()},
                                     {2.0, Eigen::Vector3d(1, 2, 3).normalized()},
                                     {3.0, Eigen::Vector3d(-3, 1, 0).normalized()}};
  for (const Eigen::AngleAxisd& turn : turns) {
    const Pose motion = Eigen::Translation3d(2000, -500, 900) * turn;
    const Scan scan = prepared_points(moved(points, motion));
    EXPECT_EQ(scan.viewpoint_source, ViewpointSource::points);
    ASSERT_EQ(scan.viewpoint.kind, Viewpoint::Kind::point);
    // A ball before a wall says little about how far away the camera was, and much about where.
    const Eigen::Vector3d error = motion.inverse() * scan.viewpoint.value - test::kCamera;
    const Eigen::Vector3d line_of_sight = (test::kBall - test::kCamera).normalized();
    EXPECT_LT(std::abs(error.dot(line_of_sight)), 0.15 * test::kBall.z()) << turn.angle();
    EXPECT_LT(error.cross(line_of_sight).norm(), 0.03 * test::kBall.z()) << turn.angle();
    EXPECT_TRUE(scan.normals_oriented);
    EXPECT_THAT(scan.warnings, testing::SizeIs(1));
  }
}

TEST(ViewpointSearch, FindsATripodAndNotAnOriginElsewhereInTheRoom) {
  const Eigen::Vector3d tripod(-2000, -1000, 0);
  const Scan scan = prepared_points(test::seen_from_tripod(tripod, 0.5));
  ASSERT_EQ(scan.viewpoint_source, ViewpointSource::points);
  EXPECT_LT((scan.viewpoint.value - tripod).norm(), 400.0);  // a tenth of the usual range
  const Scan truly = prepared_points(moved(test::seen_from_tripod(tripod, 0.5), Pose(Eigen::Translation3d(-tripod))));
  EXPECT_EQ(truly.viewpoint_source, ViewpointSource::origin);
}

// Strays all around widen the picture, and must not fill the memory with empty cells.
TEST(ViewpointSearch, IsNotLedAstrayByStrays) {
  auto points = test::seen_by_camera(test::kCamera);
  for (const Eigen::Vector3f& stray : test::sphere_cloud(test::kCamera, 1500.0, 100, -2.0, 0.0, 1).positions) {
    points.push_back(stray);
  }
  const Eigen::Vector3d shift(3000, -500, 900);
  const Scan scan = prepared_points(moved(points, Pose(Eigen::Translation3d(shift))));
  ASSERT_EQ(scan.viewpoint_source, ViewpointSource::points);
  EXPECT_LT((scan.viewpoint.value - test::kCamera - shift).norm(), 0.15 * test::kWall);
}

TEST(ViewpointSearch, StopsWhenCancelled) {
  const auto points = test::seen_by_camera(test::kCamera);
  const PointDensity density = test::density_of(points, Context(1));
  std::stop_source stop;
  stop.request_stop();
  Context stopped(1);
  stopped.stop = stop.get_token();
  EXPECT_FALSE(find_viewpoint(points, density, 0.0, {}, stopped).has_value());
}

TEST(ViewpointSearch, LeavesTheOriginWhereTheCameraStoodThere) {
  const Scan scan = prepared_points(test::seen_by_camera(Eigen::Vector3d::Zero()));
  EXPECT_EQ(scan.viewpoint_source, ViewpointSource::origin);
  EXPECT_TRUE(scan.viewpoint.value.isZero(0.0));
  EXPECT_THAT(scan.warnings, testing::IsEmpty());
}

TEST(ViewpointSearch, FindsNothingInAMergedCloud) {
  auto merged = test::seen_by_camera(test::kCamera);
  for (const Eigen::Vector3d& other : {Eigen::Vector3d(500, 200, 100), Eigen::Vector3d(-450, 100, 200)}) {
    const auto more = test::seen_by_camera(other);
    merged.insert(merged.end(), more.begin(), more.end());
  }
  EXPECT_FALSE(find_viewpoint(merged, test::density_of(merged, Context(2)), 0.0, {}, Context(2)).has_value());
}

TEST(ViewpointSearch, FindsNothingInAnEvenCloud) {
  const Scan scan = prepared_points(test::sphere_cloud(test::kBall, 100.0, 20000, -2.0, 0.0, 1).positions);
  EXPECT_EQ(scan.viewpoint_source, ViewpointSource::none);
}

TEST(ViewpointSearch, LeavesTheOriginToAThinnedCloud) {
  const auto points = test::seen_by_camera(Eigen::Vector3d::Zero(), 300);
  for (const double spacing : {3.0, 6.0, 12.0}) {
    std::vector<Eigen::Vector3f> thinned;
    for (const std::uint32_t i : even_subset(points, spacing, Context(2))) thinned.push_back(points[i]);
    EXPECT_EQ(prepared_points(thinned).viewpoint_source, ViewpointSource::origin) << spacing;
  }
}

TEST(ViewpointSearch, DoesNotOverruleTheUser) {
  const auto points = moved(test::seen_by_camera(test::kCamera), Pose(Eigen::Translation3d(2000, 0, 0)));
  EXPECT_FALSE(prepared_points(points, test::stated(Viewpoint::Kind::none)).viewpoint.known());
  const Scan stated = prepared_points(points, test::from_point(1, 2, 3));
  EXPECT_EQ(stated.viewpoint_source, ViewpointSource::stated);
  EXPECT_EQ(stated.viewpoint.value, Eigen::Vector3d(1, 2, 3));
}

TEST(ViewpointSearch, IsTheSameForAnyNumberOfThreads) {
  const auto points = test::seen_by_camera(test::kCamera);
  const auto one = find_viewpoint(points, test::density_of(points, Context(1)), 0.0, {}, Context(1));
  const auto four = find_viewpoint(points, test::density_of(points, Context(4)), 0.0, {}, Context(4));
  ASSERT_TRUE(one && four);
  EXPECT_EQ(one->position_in_scan, four->position_in_scan);
}

}  // namespace
}  // namespace asbuilt::scan
