// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/random.h"

namespace asbuilt {
namespace {

using Eigen::Vector3d;

Vector3d random_vector(Random& random) { return {random.normal(), random.normal(), random.normal()}; }

Pose random_pose(Random& random) {
  Vector6d twist;
  twist << random_vector(random).normalized() * random.uniform(0.0, std::numbers::pi), 100.0 * random_vector(random);
  return pose_from_twist(twist);
}

TEST(PoseProperty, AngleOfAnAxisAngleVectorIsItsLength) {
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    Random random(seed, "angle", 0);
    // Half of the angles tiny, half of them close to a half turn: where other formulas lose their digits.
    const double tiny = std::pow(10.0, random.uniform(-12.0, -1.0));
    const double angle = seed % 2 == 0 ? tiny : std::numbers::pi - tiny;
    const Vector3d axis = random_vector(random).normalized();
    EXPECT_NEAR(rotation_angle(rotation_from_axis_angle(angle * axis)), angle, 1e-14) << "seed " << seed;
  }
}

TEST(PoseProperty, OppositeTwistsOfPureRotationsUndoEachOther) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed, "inverse", 0);
    const Vector3d w = 3.0 * random_vector(random);
    const Eigen::Matrix3d product = rotation_from_axis_angle(w) * rotation_from_axis_angle(-w);
    EXPECT_LT((product - Eigen::Matrix3d::Identity()).norm(), 1e-14) << "seed " << seed;
  }
}

struct Pairs {
  std::vector<Vector3d> from, to;
  std::vector<double> weights;
};

Pairs noisy_pairs(Random& random) {
  Pairs pairs;
  const Pose truth = random_pose(random);
  for (int i = 0; i < 30; ++i) {
    pairs.from.push_back(10.0 * random_vector(random));
    pairs.to.push_back(truth * pairs.from.back() + random_vector(random));
    pairs.weights.push_back(random.uniform());
  }
  return pairs;
}

double cost(const Pairs& pairs, const Pose& pose) {
  double sum = 0.0;
  for (std::size_t i = 0; i < pairs.from.size(); ++i) {
    sum += pairs.weights[i] * (pose * pairs.from[i] - pairs.to[i]).squaredNorm();
  }
  return sum;
}

TEST(PoseProperty, NoNeighbourOfTheBestRigidMotionIsBetter) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Random random(seed, "neighbours", 0);
    const Pairs pairs = noisy_pairs(random);
    const Pose best = best_rigid_motion(pairs.from, pairs.to, pairs.weights);
    EXPECT_TRUE(is_rigid(best.matrix(), 1e-12));
    for (int trial = 0; trial < 50; ++trial) {
      Vector6d step;
      step << 1e-3 * random_vector(random), 1e-2 * random_vector(random);
      EXPECT_GT(cost(pairs, pose_from_twist(step) * best), cost(pairs, best)) << "seed " << seed;
    }
  }
}

TEST(PoseProperty, BestRigidMotionFollowsTheTargetFrame) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Random random(seed, "frames", 0);
    Pairs pairs = noisy_pairs(random);
    const Pose best = best_rigid_motion(pairs.from, pairs.to, pairs.weights);
    const Pose other_from_to = random_pose(random);
    for (Vector3d& point : pairs.to) point = other_from_to * point;
    const Pose expected = other_from_to * best;
    const Pose found = best_rigid_motion(pairs.from, pairs.to, pairs.weights);
    EXPECT_LT((found.matrix() - expected.matrix()).cwiseAbs().maxCoeff(), 1e-10) << "seed " << seed;
  }
}

}  // namespace
}  // namespace asbuilt
