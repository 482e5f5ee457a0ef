// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/hold.h"

#include <gmock/gmock.h>

#include <cmath>

namespace asbuilt::refine {
namespace {

using Motions = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr double kRadius = 10.0, kDiameter = 100.0, kNoise = 0.1;
const Eigen::Vector3d kCentre(5, 6, 7);

TEST(Hold, ATurnAboutAnAxisBesideTheCentreComesWithAPointOfThatAxis) {
  // About z through (1, 2, .): the centre moves with w x (centre - axis).
  const Eigen::Vector3d axis_point(1, 2, 0), w(0, 0, 0.1);
  Motions basis(6, 1);
  basis.col(0) << kRadius * w, w.cross(kCentre - axis_point);
  basis.col(0).normalize();
  const auto motions = slides_and_turns(basis, kCentre, kRadius);
  ASSERT_EQ(motions.size(), 1U);
  EXPECT_TRUE(motions[0].is_turn);
  EXPECT_NEAR(motions[0].direction.z(), 1.0, 1e-12);
  EXPECT_LT((motions[0].through - axis_point).head<2>().norm(), 1e-9);
}

TEST(Hold, ASlideIsFoundInAnyMixtureWithATurn) {
  const double c = std::cos(0.7), s = std::sin(0.7);
  Motions basis = Motions::Zero(6, 2);  // turn about and slide along y, mixed
  basis(1, 0) = c, basis(4, 0) = s;
  basis(1, 1) = -s, basis(4, 1) = c;
  const auto motions = slides_and_turns(basis, kCentre, kRadius);
  ASSERT_EQ(motions.size(), 2U);
  EXPECT_FALSE(motions[0].is_turn);
  EXPECT_TRUE(motions[1].is_turn);
  for (const Motion& motion : motions) EXPECT_NEAR(motion.direction.y(), 1.0, 1e-12);
  EXPECT_LT((motions[1].through - kCentre).norm(), 1e-9);
}

TEST(Hold, WhatNothingHoldsIsLooseByADiameter) {
  const ViewHold hold =
      view_hold(1e8 * Matrix6d::Identity(), Motions::Identity(6, 6), kCentre, kRadius, kNoise, kDiameter);
  EXPECT_EQ(hold.sigma_mm, Vector6d::Constant(kDiameter));
  ASSERT_EQ(hold.loose.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(hold.loose[i].unheld);
    EXPECT_EQ(hold.loose[i].motion.is_turn, i >= 3);
  }
}

TEST(Hold, AMotionFourTimesWorseThanUsualAndAboveTheNoiseIsLoose) {
  Vector6d sigma = Vector6d::Constant(0.02);
  const auto hold_of = [&](double along_x, double turn_z) {
    sigma[3] = along_x, sigma[2] = turn_z;
    return view_hold(sigma.cwiseAbs2().asDiagonal(), Motions(6, 0), kCentre, kRadius, kNoise, kDiameter);
  };
  EXPECT_TRUE(hold_of(0.099, 0.02).loose.empty()) << "below the noise";
  const ViewHold slide = hold_of(0.3, 0.02);
  ASSERT_EQ(slide.loose.size(), 1U);
  EXPECT_FALSE(slide.loose[0].unheld);
  EXPECT_FALSE(slide.loose[0].motion.is_turn);
  EXPECT_NEAR(slide.loose[0].motion.direction.x(), 1.0, 1e-9);
  EXPECT_NEAR(slide.loose[0].sigma_mm, 0.3, 1e-9);
  EXPECT_NEAR(slide.sigma_mm[0], 0.3, 1e-9);
  EXPECT_NEAR(slide.sigma_mm[5], 0.02, 1e-9);
  const ViewHold both = hold_of(0.3, 0.5);
  ASSERT_EQ(both.loose.size(), 2U);
  EXPECT_TRUE(both.loose[1].motion.is_turn);
  EXPECT_NEAR(both.loose[1].sigma_mm, 0.5, 1e-9);
}

}  // namespace
}  // namespace asbuilt::refine
