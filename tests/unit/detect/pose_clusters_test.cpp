// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/pose_clusters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <numeric>

#include "support/matchers.h"
#include "unit/detect/oriented_points.h"

namespace asbuilt::detect {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

// A pose that turns by `degrees` about z and puts the model's centre at `centre_in_scan`.
Hypothesis placed(double degrees, const Eigen::Vector3d& centre_in_scan, const Eigen::Vector3d& centre_in_model,
                  double votes) {
  Hypothesis pose;
  pose.model_from_scan.linear() = Eigen::AngleAxisd(degrees * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.model_from_scan.translation() = centre_in_model - pose.model_from_scan.linear() * centre_in_scan;
  pose.votes = votes;
  return pose;
}

const Eigen::Vector3d kCentre(30, -20, 10);

std::vector<Hypothesis> cluster(const std::vector<Hypothesis>& poses, const ClusterOptions& options, int threads = 2) {
  return cluster_poses(poses, kCentre, options, Context(threads));
}

TEST(MeanPose, OfRotationsAboutOneAxisIsTheMeanAngle) {
  const std::vector<Hypothesis> poses{placed(10, {0, 0, 0}, kCentre, 1), placed(20, {2, 0, 0}, kCentre, 1)};
  const Hypothesis expected = placed(15, {1, 0, 0}, kCentre, 2);
  EXPECT_THAT(mean_pose(poses, kCentre), test::PoseNear(expected.model_from_scan, 1e-9, 1e-9));
}

// Quaternions of rotations by 179 and 181 degrees have opposite signs when made from matrices; without aligning them
// the mean would be a rotation about another axis, or none.
TEST(MeanPose, DoesNotDependOnTheSignsOfQuaternions) {
  for (const double middle : {0.0, 90.0, 180.0, 270.0}) {
    const std::vector<Hypothesis> poses{placed(middle - 4, {0, 0, 0}, kCentre, 1),
                                        placed(middle + 4, {0, 0, 0}, kCentre, 1)};
    EXPECT_THAT(mean_pose(poses, kCentre),
                test::PoseNear(placed(middle, {0, 0, 0}, kCentre, 1).model_from_scan, 1e-9, 1e-9));
  }
}

TEST(MeanPose, IsWeightedByVotes) {
  const std::vector<Hypothesis> poses{placed(0, {0, 0, 0}, kCentre, 3), placed(4, {4, 8, 12}, kCentre, 1)};
  const Pose mean = mean_pose(poses, kCentre);
  EXPECT_LT((mean.inverse() * kCentre - Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  // Chordal and geodesic mean differ in third order: 1e-4 of 4 degrees.
  EXPECT_NEAR(rotation_angle(mean.linear()) / kDegree, 1.0, 1e-3);
}

TEST(MeanPose, IsRigid) {
  Random random(1, "mean", 0);
  std::vector<Hypothesis> poses;
  for (int i = 0; i < 20; ++i) poses.push_back({test::random_pose(random), random.uniform(0.1, 5.0)});
  EXPECT_TRUE(is_rigid(mean_pose(poses, kCentre).matrix(), 1e-12));
}

TEST(ClusterPoses, JoinsPosesThatAgreeInBothRotationAndPlace) {
  const ClusterOptions options{10.0 * kDegree, 5.0, 100};
  const std::vector<Hypothesis> poses{
      placed(0, {0, 0, 0}, kCentre, 1), placed(8, {3, 0, 0}, kCentre, 2),
      placed(12, {0, 0, 0}, kCentre, 4),    // 12 degrees from the first, 4 from the second
      placed(0, {40, 0, 0}, kCentre, 8),    // elsewhere
      placed(90, {0, 0, 0}, kCentre, 16)};  // another attitude
  const auto clusters = cluster(poses, options);
  ASSERT_EQ(clusters.size(), 3U);
  EXPECT_EQ(clusters[0].votes, 16.0);
  EXPECT_EQ(clusters[1].votes, 8.0);
  EXPECT_EQ(clusters[2].votes, 7.0);  // the second is within reach of both others and has the most support
}

// A threshold on rotations must be able to reject; one on the trace or on Euler angles has failed users before.
TEST(ClusterPoses, TellsRotationsApartWhateverTheirAxis) {
  Random random(2, "cluster", 0);
  for (int trial = 0; trial < 100; ++trial) {
    const Pose base = test::random_pose(random);
    const Eigen::Vector3d axis = test::random_oriented_point(random).normal.cast<double>().normalized();
    for (const double degrees : {9.5, 10.5}) {
      Pose turned = base;
      turned.linear() = Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix() * base.linear();
      turned.translation() = kCentre - turned.linear() * (base.inverse() * kCentre);  // the centre stays
      const auto clusters = cluster({{base, 1.0}, {turned, 1.0}}, {10.0 * kDegree, 1.0, 10});
      EXPECT_EQ(clusters.size(), degrees < 10.0 ? 1U : 2U) << degrees << " degrees about " << axis.transpose();
    }
  }
}

TEST(ClusterPoses, IsSymmetricInItsPoses) {
  const Hypothesis a = placed(0, {0, 0, 0}, kCentre, 3), b = placed(9, {4, 0, 0}, kCentre, 3);
  const ClusterOptions options{10.0 * kDegree, 5.0, 100};
  const auto one = cluster({a, b}, options), other = cluster({b, a}, options);
  ASSERT_EQ(one.size(), 1U);
  ASSERT_EQ(other.size(), 1U);
  EXPECT_THAT(one[0].model_from_scan, test::PoseNear(other[0].model_from_scan, 1e-9, 1e-9));
}

std::vector<Hypothesis> scattered(std::uint64_t seed) {
  Random random(seed, "scattered", 0);
  std::vector<Hypothesis> poses;
  for (int group = 0; group < 8; ++group) {
    const Pose centre = test::random_pose(random);
    for (int i = 0; i < 20; ++i) {
      Vector6d twist;
      for (int k = 0; k < 6; ++k) twist[k] = (k < 3 ? 0.03 : 1.0) * random.normal();
      poses.push_back({pose_from_twist(twist) * centre, random.uniform(0.5, 2.0)});
    }
  }
  return poses;
}

TEST(ClusterPoses, DoNotDependOnTheOrderOfTheInput) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    std::vector<Hypothesis> poses = scattered(seed);
    const ClusterOptions options{12.0 * kDegree, 12.0, 50};
    const auto expected = cluster(poses, options);
    Random random(seed, "shuffle", 0);
    for (std::size_t i = poses.size(); i > 1; --i) std::swap(poses[i - 1], poses[random.below(i)]);
    const auto clusters = cluster(poses, options);
    ASSERT_EQ(clusters.size(), expected.size()) << "seed " << seed;
    for (std::size_t i = 0; i < clusters.size(); ++i) {
      // Sums in another order differ in the last bits.
      EXPECT_NEAR(clusters[i].votes, expected[i].votes, 1e-9);
      EXPECT_THAT(clusters[i].model_from_scan, test::PoseNear(expected[i].model_from_scan, 1e-6, 1e-6));
    }
  }
}

TEST(ClusterPoses, SpendEachVoteOnceAndSortByVotes) {
  const std::vector<Hypothesis> poses = scattered(99);
  const auto clusters = cluster(poses, {12.0 * kDegree, 12.0, 1000});
  double given = 0.0, found = 0.0;
  for (const Hypothesis& pose : poses) given += pose.votes;
  for (const Hypothesis& pose : clusters) found += pose.votes;
  EXPECT_NEAR(found, given, 1e-9 * given);
  EXPECT_TRUE(std::ranges::is_sorted(clusters, std::ranges::greater{}, &Hypothesis::votes));
  EXPECT_EQ(cluster(poses, {12.0 * kDegree, 12.0, 3}).size(), 3U);
  EXPECT_EQ(cluster(poses, {12.0 * kDegree, 12.0, 3})[0].votes, clusters[0].votes);
}

TEST(ClusterPoses, AreTheSameForAnyNumberOfThreads) {
  const std::vector<Hypothesis> poses = scattered(7);
  const auto expected = cluster(poses, {12.0 * kDegree, 12.0, 50}, 1);
  for (const int threads : {2, 3}) {
    const auto clusters = cluster(poses, {12.0 * kDegree, 12.0, 50}, threads);
    ASSERT_EQ(clusters.size(), expected.size());
    for (std::size_t i = 0; i < clusters.size(); ++i) {
      EXPECT_EQ(clusters[i].votes, expected[i].votes);
      EXPECT_EQ(clusters[i].model_from_scan.matrix(), expected[i].model_from_scan.matrix());
    }
  }
}

TEST(ClusterPoses, OfNothingAreNothing) { EXPECT_TRUE(cluster({}, {}).empty()); }

}  // namespace
}  // namespace asbuilt::detect
