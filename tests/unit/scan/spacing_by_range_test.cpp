// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/spacing_by_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "asbuilt/core/point_cloud.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

const Viewpoint kOrigin{Viewpoint::Kind::point, Eigen::Vector3d::Zero()};

// What a scanner in the origin, turning in steps of `step` radians, measures of walls across its way: one of 20 degrees
// to either side at each distance, one beside the other.
std::vector<Eigen::Vector3f> walls_at(std::initializer_list<double> distances_mm, double step) {
  std::vector<Eigen::Vector3f> points;
  double around = 0.0;
  for (const double distance : distances_mm) {
    const Eigen::AngleAxisd turn(around, Eigen::Vector3d::UnitY());
    around += 0.8;
    for (double a = -0.35; a < 0.35; a += step) {
      for (double b = -0.35; b < 0.35; b += step) {
        const Eigen::Vector3d ray(std::tan(a), std::tan(b) / std::cos(a), 1.0);
        points.push_back((turn * (distance * ray)).cast<float>());
      }
    }
  }
  return points;
}

TEST(SpacingByRange, OfEvenStepsOfAngleGrowsWithTheRange) {
  constexpr double kStep = 0.01;
  const auto points = walls_at({500, 1000, 2000, 4000}, kStep);
  const SpacingByRange spacing(points, KdTree(points), kOrigin);
  ASSERT_TRUE(spacing.known());
  // Along the wall, the next measurement is a step of the range away, and up to 1 / cos 20 deg more.
  for (const double range : {520.0, 1040.0, 2080.0, 4150.0}) {
    const double found = spacing.at({0, 0, range});
    EXPECT_GE(found, 0.93 * kStep * range);
    EXPECT_LE(found, 1.10 * kStep * range);
  }
  EXPECT_EQ(spacing.at({0, 0, 1}), spacing.at({0, 0, 100})) << "nearer than anything";
  EXPECT_EQ(spacing.at({0, 0, 9000}), spacing.at({0, 20000, 0})) << "farther than anything";
}

TEST(SpacingByRange, IncreasesFromBandToBandWithoutJumps) {
  const auto points = walls_at({500, 700, 1000, 1400, 2000}, 0.01);
  const SpacingByRange spacing(points, KdTree(points), kOrigin);
  double before = spacing.at({0, 0, 400});
  for (double range = 401.0; range < 2500.0; range += 1.0) {
    const double here = spacing.at({0, 0, range});
    EXPECT_GE(here, 0.97 * before) << range;
    EXPECT_LE(here, 1.1 * before) << range;
    before = here;
  }
}

TEST(SpacingByRange, OfAGridIsTheSameEverywhere) {
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j)
      points.emplace_back(10.0F * static_cast<float>(i), 10.0F * static_cast<float>(j), 200.0F);
  }
  const SpacingByRange spacing(points, KdTree(points), kOrigin);
  for (const double range : {200.0, 500.0, 1000.0, 1400.0}) EXPECT_NEAR(spacing.at({0, 0, range}), 10.0, 1e-4);
}

TEST(SpacingByRange, KnowsNothingWithoutAPlaceToMeasureFrom) {
  const auto points = walls_at({500, 1000}, 0.02);
  const KdTree tree(points);
  EXPECT_FALSE(SpacingByRange().known());
  EXPECT_FALSE(SpacingByRange(points, tree, Viewpoint{}).known());
  EXPECT_FALSE(SpacingByRange(points, tree, Viewpoint{Viewpoint::Kind::direction, Eigen::Vector3d::UnitZ()}).known());
  const std::vector<Eigen::Vector3f> few(points.begin(), points.begin() + 20);
  EXPECT_FALSE(SpacingByRange(few, KdTree(few), kOrigin).known());
}

}  // namespace
}  // namespace asbuilt::scan
