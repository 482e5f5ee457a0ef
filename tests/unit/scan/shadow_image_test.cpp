// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/shadow_image.h"

#include <gtest/gtest.h>

#include "unit/scan/camera.h"

namespace asbuilt::scan {
namespace {

constexpr DepthJump kJump{0.03F, 0.0F};

Shadows seen_from(const Eigen::Vector3d& position) {
  static const std::vector<Eigen::Vector3f> points = test::seen_by_camera(test::kCamera);
  return ShadowImage(points).seen_from(position, 1.5 * test::pixel_angle(), kJump);
}

TEST(ShadowImage, HidesNothingAndMissesLittleFromWhereTheCameraStood) {
  const Shadows shadows = seen_from(test::kCamera);
  // Of a cell that the ball's outline crosses, the wall's points are hidden: some 200 of 22500.
  EXPECT_LT(shadows.hidden, 0.012);
  EXPECT_LT(shadows.gaps, 0.02);
}

TEST(ShadowImage, HidesMoreFromNearerAndMissesMoreFromFarther) {
  // From 480 mm away the ball, 80 mm nearer, covers (600 / 480)^2 as much of the picture: what it hid and some more.
  EXPECT_GT(seen_from(test::kCamera + Eigen::Vector3d(0, 0, 120)).hidden, 3.0 * seen_from(test::kCamera).hidden);
  const Shadows farther = seen_from(test::kCamera - Eigen::Vector3d(0, 0, 150));
  EXPECT_GT(farther.gaps, 3.0 * seen_from(test::kCamera).gaps);
  EXPECT_LT(farther.hidden, seen_from(test::kCamera + Eigen::Vector3d(0, 0, 120)).hidden / 3.0);
}

TEST(ShadowImage, FitsWorseFromBesideTheCamera) {
  const double there = seen_from(test::kCamera).misfit();
  for (const double side : {-60.0, 60.0}) {
    EXPECT_GT(seen_from(test::kCamera + Eigen::Vector3d(side, 0, 0)).misfit(), 1.5 * there) << side;
    EXPECT_GT(seen_from(test::kCamera + Eigen::Vector3d(0, side, 0)).misfit(), 1.5 * there) << side;
  }
}

TEST(DepthJump, GrowsWithTheDepthButNotBelowItsLeast) {
  constexpr DepthJump jump{0.1F, 5.0F};
  EXPECT_FALSE(jump.is_between(20.0F, 24.0F));
  EXPECT_TRUE(jump.is_between(20.0F, 26.0F));
  EXPECT_FALSE(jump.is_between(200.0F, 215.0F));
  EXPECT_TRUE(jump.is_between(200.0F, 225.0F));
}

}  // namespace
}  // namespace asbuilt::scan
