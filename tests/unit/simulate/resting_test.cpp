// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/resting.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

TEST(Resting, ABlockComesToRestOnOneOfItsFaces) {
  const TriangleMesh block = box({60, 40, 25});
  for (std::uint64_t i = 0; i < 20; ++i) {
    Random random(1, "rest", i);
    const Eigen::Matrix3d rotation = resting_rotation(block, random);
    EXPECT_TRUE((rotation * rotation.transpose()).isIdentity(1e-12));
    EXPECT_GT(rotation.determinant(), 0.0);
    // The direction of the floor in the block's frame is an axis.
    EXPECT_NEAR(rotation.row(2).cwiseAbs().maxCoeff(), 1.0, 1e-3);
  }
}

TEST(Resting, HeightPutsTheLowestPointOnTheFloor) {
  Random random(1, "rest", 7);
  const Eigen::Matrix3d rotation = random_rotation(random);
  const TriangleMesh block = test::stepped_block();
  const double height = height_on_floor(block, rotation);
  double lowest = 1e9;
  for (const Eigen::Vector3d& v : block.vertices) lowest = std::min(lowest, (rotation * v).z() + height);
  EXPECT_NEAR(lowest, 0.0, 1e-9);
}

}  // namespace
}  // namespace asbuilt::simulate
