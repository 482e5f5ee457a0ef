// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/point_density.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/scan/camera.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

TEST(PointDensity, IsExplainedFromWhereTheCameraStood) {
  const PointDensity density = test::density_of(test::seen_by_camera(test::kCamera), Context(1));
  ASSERT_TRUE(density.known());
  EXPECT_LT(density.misfit(test::kCamera), 0.1);
  // The wall, which the camera faces, is measured evenly; ball and floor are not.
  EXPECT_GT(density.misfit_of_even(), 2.0 * density.misfit(test::kCamera));
}

TEST(PointDensity, ContradictsOtherPlaces) {
  const PointDensity density = test::density_of(test::seen_by_camera(test::kCamera), Context(1));
  // Amid the scene, beside it, and behind it, at the same distance from the ball.
  for (const Eigen::Vector3d& other : {Eigen::Vector3d(0, 0, 450), Eigen::Vector3d(700, 0, 600),
                                       Eigen::Vector3d(20, 10, 1200), Eigen::Vector3d(0, 600, 600)}) {
    EXPECT_GT(density.misfit(other), 3.0 * density.misfit(test::kCamera)) << other.transpose();
  }
}

TEST(PointDensity, FitsThePlaceOfTheCamera) {
  const PointDensity density = test::density_of(test::seen_by_camera(test::kCamera), Context(2));
  const auto fits = density.fits(Context(2));
  ASSERT_FALSE(fits.empty());
  const PointDensity::Fit& best = fits.front();
  EXPECT_EQ(best.steps, PointDensity::Steps::tangents);
  EXPECT_LT((best.position_in_scan - test::kCamera).norm(), 0.1 * test::kBall.z());
  // A steradian holds 1 / angle^2 pixels.
  EXPECT_NEAR(-0.5 * best.log_rate, std::log(test::pixel_angle()), 0.15);
  EXPECT_TRUE(std::ranges::is_sorted(fits, {}, &PointDensity::Fit::misfit));
}

TEST(PointDensity, OfAnEvenCloudIsEven) {
  const auto ball = test::sphere_cloud(test::kBall, 100.0, 20000, -2.0, 0.0, 1).positions;
  const PointDensity density = test::density_of(ball, Context(1));
  ASSERT_TRUE(density.known());
  EXPECT_LT(density.misfit_of_even(), 0.05);
  EXPECT_GT(density.misfit(test::kCamera), 4.0 * density.misfit_of_even());
}

TEST(PointDensity, NeedsEnoughPlacesAwayFromEdges) {
  const auto few = test::plane_cloud(10.0, 1.0, 300.0, 0.0, 1).positions;
  const PointDensity density = test::density_of(few, Context(1));
  EXPECT_FALSE(density.known());
  EXPECT_THAT(density.fits(Context(1)), testing::IsEmpty());
}

}  // namespace
}  // namespace asbuilt::scan
