// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/scan/normals.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

double estimate(const PointCloud& cloud) {
  return estimate_noise(cloud.positions, KdTree(cloud.positions), Context(2));
}

TEST(NoiseEstimate, OfAPlaneIsWithinFifteenPercentOfTheTruth) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const double sigma : {0.02, 0.1, 0.4}) {  // at a spacing of 1
      const double found = estimate(test::plane_cloud(100.0, 1.0, 50.0, sigma, seed));
      EXPECT_NEAR(found / sigma, 1.0, 0.15) << "seed " << seed << ", sigma " << sigma;
    }
  }
}

// A plane fit would see the sagitta of 20 points, here 0.06 mm, as noise.
TEST(NoiseEstimate, OfASphereIsNotInflatedByItsCurvature) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const double sigma : {0.02, 0.1, 0.4}) {
      const double radius = 50.0;  // 4 pi r^2 / 31416 points: a spacing of 1
      const double found = estimate(test::sphere_cloud({0, 0, 200}, radius, 31416, -2.0, sigma, seed));
      EXPECT_NEAR(found / sigma, 1.0, 0.15) << "seed " << seed << ", sigma " << sigma;
    }
  }
}

TEST(NoiseEstimate, OfAnExactPlaneIsNothing) { EXPECT_LT(estimate(test::plane_cloud(50.0, 1.0, 50.0, 0.0, 1)), 1e-4); }

TEST(NoiseEstimate, FollowsTheScaleOfTheScan) {
  const PointCloud cloud = test::plane_cloud(60.0, 1.0, 50.0, 0.1, 7);
  PointCloud doubled = cloud;
  for (Eigen::Vector3f& p : doubled.positions) p *= 2.0F;
  EXPECT_NEAR(estimate(doubled) / estimate(cloud), 2.0, 1e-3);
}

TEST(NoiseEstimate, OfTooFewPointsIsZero) { EXPECT_EQ(estimate(test::plane_cloud(3.0, 1.0, 50.0, 0.1, 1)), 0.0); }

}  // namespace
}  // namespace asbuilt::scan
