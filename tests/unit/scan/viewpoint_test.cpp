// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/viewpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "asbuilt/scan/scan.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

Viewpoint viewpoint_at(double x, double y, double z) { return {Viewpoint::Kind::point, {x, y, z}}; }

// A ball before a wall as a sensor at the origin sees them: the cap that faces it, and the wall outside the shadow.
PointCloud ball_before_wall() {
  const Eigen::Vector3d centre(0, 0, 300);
  const double radius = 50.0;
  PointCloud cloud;
  for (const Eigen::Vector3f& p : test::sphere_cloud(centre, radius, 16000, -2.0, 0.0, 1).positions) {
    const Eigen::Vector3d point = p.cast<double>();
    if ((point - centre).dot(-point) > 0.15 * radius * point.norm()) cloud.positions.push_back(p);
  }
  const double shadow = std::asin(radius / centre.norm());
  for (const Eigen::Vector3f& p : test::plane_cloud(400.0, 2.0, 400.0, 0.0, 1).positions) {
    if (std::atan2(p.head<2>().norm(), p.z()) > shadow) cloud.positions.push_back(p);
  }
  return cloud;
}

TEST(Viewpoint, TowardsTheSensorIsAUnitVector) {
  EXPECT_EQ(viewpoint_at(0, 0, 10).towards_sensor({0, 0, 4}), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ((Viewpoint{Viewpoint::Kind::direction, {0, 1, 0}}.towards_sensor({5, 5, 5})), Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(Viewpoint{}.towards_sensor({1, 2, 3}), Eigen::Vector3d::Zero());
}

TEST(HiddenShare, IsSmallFromWhereTheScanWasTakenAndLargeFromTheSide) {
  const PointCloud cloud = ball_before_wall();
  EXPECT_LT(hidden_share(cloud.positions, 2.0, viewpoint_at(0, 0, 0)), 0.02);
  // From the side the ball stands before points that it did not hide from the origin.
  EXPECT_GT(hidden_share(cloud.positions, 2.0, viewpoint_at(280, 0, 120)), 0.03);
}

TEST(HiddenShare, CountsTheHiddenHalfOfTwoSheets) {
  // Seen from below, the upper of two equal sheets is hidden but for its rim.
  PointCloud sheets = test::plane_cloud(100.0, 1.0, 200.0, 0.0, 1);
  const PointCloud upper = test::plane_cloud(100.0, 1.0, 230.0, 0.0, 2);
  sheets.positions.insert(sheets.positions.end(), upper.positions.begin(), upper.positions.end());
  const double share =
      hidden_share(sheets.positions, 1.0, Viewpoint{Viewpoint::Kind::direction, Eigen::Vector3d::UnitZ()});
  // A cell is 1.5 spacings wide and empty with the probability of about e^-2.25 = 0.1 at worst.
  EXPECT_GT(share, 0.4);
  EXPECT_LT(share, 0.5);
}

TEST(DepthOrder, SignedNormalsThatLookAwayRuleAViewpointOut) {
  const PointCloud cloud = test::plane_cloud(100.0, 1.0, 200.0, 0.0, 1);
  const std::vector<Eigen::Vector3f> fitted(cloud.size(), Eigen::Vector3f(0, 0, 1));
  const std::vector<Eigen::Vector3f> towards(cloud.size(), Eigen::Vector3f(0, 0, -1));
  EXPECT_TRUE(agrees_with_depth_order(cloud.positions, fitted, {}, 1.0, viewpoint_at(0, 0, 0)));
  EXPECT_TRUE(agrees_with_depth_order(cloud.positions, fitted, towards, 1.0, viewpoint_at(0, 0, 0)));
  EXPECT_FALSE(agrees_with_depth_order(cloud.positions, fitted, fitted, 1.0, viewpoint_at(0, 0, 0)));
}

TEST(DepthOrder, SurfacesSeenEdgeOnRuleAViewpointOut) {
  const PointCloud cloud = test::plane_cloud(100.0, 1.0, 200.0, 0.0, 1);
  const std::vector<Eigen::Vector3f> fitted(cloud.size(), Eigen::Vector3f(0, 0, 1));
  EXPECT_FALSE(agrees_with_depth_order(cloud.positions, fitted, {}, 1.0, viewpoint_at(1000, 0, 205)));
}

TEST(DepthOrder, HasNoAnswerWithoutPointsOrViewpoint) {
  const PointCloud cloud = test::plane_cloud(100.0, 1.0, 200.0, 0.0, 1);
  EXPECT_FALSE(agrees_with_depth_order({}, {}, {}, 1.0, viewpoint_at(0, 0, 0)));
  EXPECT_FALSE(agrees_with_depth_order(cloud.positions, cloud.positions, {}, 1.0, Viewpoint{}));
}

TEST(PrepareScan, TakesTheViewpointOfTheFileUnlessTheUserStatesOne) {
  const PointCloud cloud = test::plane_cloud(50.0, 1.0, 200.0, 0.0, 1);
  const Eigen::Vector3d in_file(1, 2, 3);
  const Scan automatic = prepare_scan(cloud, in_file, {}, {}, Context(1)).value();
  EXPECT_EQ(automatic.viewpoint.kind, Viewpoint::Kind::point);
  EXPECT_EQ(automatic.viewpoint.value, in_file);
  const Scan stated = prepare_scan(cloud, in_file, test::from_point(7, 8, 9), {}, Context(1)).value();
  EXPECT_EQ(stated.viewpoint.value, Eigen::Vector3d(7, 8, 9));
  const Scan none = prepare_scan(cloud, in_file, test::stated(Viewpoint::Kind::none), {}, Context(1)).value();
  EXPECT_FALSE(none.viewpoint.known());
}

}  // namespace
}  // namespace asbuilt::scan
