// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/point_pair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "support/matchers.h"
#include "unit/detect/oriented_points.h"

namespace asbuilt::detect {
namespace {

using test::OrientedPoint;

constexpr double kPi = std::numbers::pi;

PointPairFeature feature_of(const OrientedPoint& i, const OrientedPoint& j) {
  return point_pair_feature(i.position, i.normal, j.position, j.normal);
}

// Eq. 6 is made of angles; users of other libraries were bitten by dot products in their place.
TEST(PointPairFeature, HoldsAnglesAndNotTheirCosines) {
  // d = p_i - p_j = (3, 0, 4), of length 5; n_i along z: cos 0.8; n_j along -x: cos -0.6; n_i to n_j: 90 degrees.
  const PointPairFeature feature = point_pair_feature({3, 0, 4}, {0, 0, 1}, {0, 0, 0}, {-1, 0, 0});
  EXPECT_NEAR(feature.distance, 5.0, 1e-6);
  EXPECT_NEAR(feature.angle_i_d, std::acos(0.8), 1e-6);
  EXPECT_NEAR(feature.angle_j_d, std::acos(-0.6), 1e-6);
  EXPECT_NEAR(feature.angle_i_j, 0.5 * kPi, 1e-6);
}

TEST(PointPairFeature, OfOpposedNormalsOnOneLineIsZeroAndPi) {
  const PointPairFeature feature = point_pair_feature({0, 0, 2}, {0, 0, 1}, {0, 0, 0}, {0, 0, -1});
  EXPECT_NEAR(feature.angle_i_d, 0.0, 1e-3);  // acos of a float near 1
  EXPECT_NEAR(feature.angle_j_d, kPi, 1e-3);
  EXPECT_NEAR(feature.angle_i_j, kPi, 1e-3);
}

TEST(PointPairFeature, DoesNotChangeWhenBothPointsMove) {
  Random random(1, "feature", 0);
  for (int trial = 0; trial < 500; ++trial) {
    const OrientedPoint i = test::random_oriented_point(random), j = test::random_oriented_point(random);
    const Pose motion = test::random_pose(random);
    const PointPairFeature before = feature_of(i, j), after = feature_of(moved(motion, i), moved(motion, j));
    EXPECT_NEAR(after.distance, before.distance, 1e-3);
    EXPECT_NEAR(after.angle_i_d, before.angle_i_d, 2e-3);
    EXPECT_NEAR(after.angle_j_d, before.angle_j_d, 2e-3);
    EXPECT_NEAR(after.angle_i_j, before.angle_i_j, 2e-3);
  }
}

TEST(LocalFrame, PutsThePointAtTheOriginAndItsNormalOnX) {
  Random random(2, "frame", 0);
  std::vector<OrientedPoint> points{{{1, 2, 3}, {1, 0, 0}}, {{1, 2, 3}, {-1, 0, 0}}, {{1, 2, 3}, {0, -1, 0}}};
  for (int i = 0; i < 200; ++i) points.push_back(test::random_oriented_point(random));
  for (const OrientedPoint& point : points) {
    const Pose frame = local_frame(point.position, point.normal);
    EXPECT_TRUE(is_rigid(frame.matrix(), 1e-9));
    EXPECT_LT((frame * point.position.cast<double>()).norm(), 1e-9);
    EXPECT_LT((frame.linear() * point.normal.cast<double>() - Eigen::Vector3d::UnitX()).norm(), 1e-6);
  }
}

TEST(AngleInFrame, IsMeasuredFromYTowardsZ) {
  const Eigen::Matrix3f straight = Eigen::Matrix3f::Identity();
  EXPECT_NEAR(angle_in_frame(straight, {5, 1, 0}), 0.0, 1e-6);
  EXPECT_NEAR(angle_in_frame(straight, {5, 0, 1}), 0.5 * kPi, 1e-6);
  EXPECT_NEAR(angle_in_frame(straight, {5, 0, -2}), -0.5 * kPi, 1e-6);
  EXPECT_NEAR(angle_in_frame(straight, {-5, -1, 0}), kPi, 1e-6);
}

// The one computation that everything rests on: a model pair, moved anywhere, gives the motion back.
TEST(Alpha, OfAMovedPairRecoversTheMotion) {
  Random random(3, "alpha", 0);
  for (int trial = 0; trial < 1000; ++trial) {
    OrientedPoint model_reference = test::random_oriented_point(random);
    if (trial % 50 == 0) model_reference.normal = Eigen::Vector3f(-1, 0, 0);  // where the smallest rotation is no one's
    const OrientedPoint model_other = test::random_oriented_point(random);
    const Pose scan_from_model = test::random_pose(random);
    // In double: what is tested are definitions, not the coordinates' rounding.
    const Eigen::Vector3d scene_reference = scan_from_model * model_reference.position.cast<double>();
    const Eigen::Vector3d scene_normal = scan_from_model.linear() * model_reference.normal.cast<double>();
    const Eigen::Vector3d scene_other = scan_from_model * model_other.position.cast<double>();
    const Pose model_frame = local_frame(model_reference.position, model_reference.normal);
    Pose scene_frame = Pose::Identity();
    scene_frame.linear() =
        Eigen::Quaterniond::FromTwoVectors(scene_normal, Eigen::Vector3d::UnitX()).toRotationMatrix();
    scene_frame.translation() = -(scene_frame.linear() * scene_reference);
    const auto angle = [](const Pose& frame, const Eigen::Vector3d& point) {
      const Eigen::Vector3d local = frame * point;
      return std::atan2(local.z(), local.y());
    };
    const double alpha = angle(scene_frame, scene_other) - angle(model_frame, model_other.position.cast<double>());
    const Pose found = model_from_scan_of(model_frame, scene_frame, alpha);
    EXPECT_THAT(found, test::PoseNear(scan_from_model.inverse(), 1e-5, 1e-5)) << "trial " << trial;
  }
}

// The same by the functions that detection uses, in the floats of a cloud.
TEST(Alpha, InSinglePrecisionRecoversTheMotionToTheRoundingOfTheCoordinates) {
  Random random(4, "alpha", 0);
  for (int trial = 0; trial < 1000; ++trial) {
    const OrientedPoint model_reference = test::random_oriented_point(random);
    OrientedPoint model_other = test::random_oriented_point(random);
    const Eigen::Vector3f offset = model_other.position - model_reference.position;
    if (offset.cross(model_reference.normal).norm() < 20.0F) continue;  // on the normal's line alpha means nothing
    const Pose scan_from_model = test::random_pose(random);
    const OrientedPoint scene_reference = moved(scan_from_model, model_reference);
    const OrientedPoint scene_other = moved(scan_from_model, model_other);
    const Pose model_frame = local_frame(model_reference.position, model_reference.normal);
    const Pose scene_frame = local_frame(scene_reference.position, scene_reference.normal);
    const float scene_angle =
        angle_in_frame(scene_frame.linear().cast<float>(), scene_other.position - scene_reference.position);
    const float model_angle = angle_in_frame(model_frame.linear().cast<float>(), offset);
    const Pose found = model_from_scan_of(model_frame, scene_frame, scene_angle - model_angle);
    // Coordinates of some 500 mm are rounded to 3e-5 mm; a lever of 20 mm turns that to 1e-4 degrees.
    EXPECT_THAT(found, test::PoseNear(scan_from_model.inverse(), 2e-3, 1e-3)) << "trial " << trial;
  }
}

Quantisation quantisation() { return {10.0F, 12, 15}; }

constexpr float kAngleStep = std::numbers::pi_v<float> / 15.0F;

// A feature from the place in its bins: {3.2, 4.5, 0, 14.9} lies in distance bin 3, angle bins 4, 0 and 14.
PointPairFeature at(const std::array<double, 4>& place) {
  const auto angle = [](double bins) { return static_cast<float>(bins) * kAngleStep; };
  return {static_cast<float>(place[0]) * 10.0F, angle(place[1]), angle(place[2]), angle(place[3])};
}

std::uint32_t flat(int distance, int a, int b, int c) {
  return static_cast<std::uint32_t>(((distance * 15 + a) * 15 + b) * 15 + c);
}

std::vector<std::uint32_t> soft(const PointPairFeature& feature, int wanted, float reach = 0.5F) {
  const Quantisation::Bins bins = quantisation().soft_bins(feature, wanted, reach);
  return {bins.bin.begin(), bins.bin.begin() + bins.count};
}

TEST(Quantisation, CutsDistanceAndAnglesIntoEqualBins) {
  EXPECT_EQ(quantisation().bin_count(), 12U * 15U * 15U * 15U);
  EXPECT_EQ(quantisation().bin(at({0.0, 0.0, 0.0, 0.0})), flat(0, 0, 0, 0));
  EXPECT_EQ(quantisation().bin(at({3.2, 4.5, 0.1, 14.9})), flat(3, 4, 0, 14));
}

TEST(Quantisation, KeepsTheLastAngleBinForPi) {
  PointPairFeature feature = at({3.2, 4.5, 4.5, 4.5});
  feature.angle_i_j = std::numbers::pi_v<float>;
  EXPECT_EQ(quantisation().bin(feature), flat(3, 4, 4, 14));
}

TEST(Quantisation, HasNoBinForPairsLongerThanTheModel) {
  EXPECT_NE(quantisation().bin(at({11.99, 1.5, 1.5, 1.5})), Quantisation::kNoBin);
  EXPECT_EQ(quantisation().bin(at({12.01, 1.5, 1.5, 1.5})), Quantisation::kNoBin);
  EXPECT_EQ(quantisation().bin(at({1e9, 1.5, 1.5, 1.5})), Quantisation::kNoBin);
  PointPairFeature nonsense = at({3.2, 4.5, 4.5, 4.5});
  nonsense.distance = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(quantisation().bin(nonsense), Quantisation::kNoBin);
}

TEST(SoftBins, BeginWithTheFeaturesOwn) {
  Random random(5, "soft", 0);
  for (int trial = 0; trial < 2000; ++trial) {
    const double d = random.uniform(0.0, 12.0);
    const PointPairFeature feature =
        at({d, random.uniform(0.0, 15.0), random.uniform(0.0, 15.0), random.uniform(0.0, 15.0)});
    for (const int wanted : {1, 4, 16}) {
      const auto bins = soft(feature, wanted);
      ASSERT_FALSE(bins.empty());
      EXPECT_EQ(bins.front(), quantisation().bin(feature));
    }
  }
}

TEST(SoftBins, AreExactlyKWhereTheyExistAndAllDifferent) {
  Random random(6, "soft", 0);
  for (int trial = 0; trial < 2000; ++trial) {
    // Away from the ends of the four ranges every neighbour exists.
    const PointPairFeature feature = at(
        {random.uniform(1.0, 11.0), random.uniform(1.0, 14.0), random.uniform(1.0, 14.0), random.uniform(1.0, 14.0)});
    for (int wanted = 1; wanted <= 16; ++wanted) {
      const auto bins = soft(feature, wanted);
      EXPECT_EQ(bins.size(), static_cast<std::size_t>(wanted));
      EXPECT_EQ(std::set(bins.begin(), bins.end()).size(), bins.size());
    }
  }
}

TEST(SoftBins, CrossTheNearestBordersFirst) {
  // Distances to the borders in bins: 0.2 (down), 0.1 (up), 0.4 (down), 0.3 (up).
  const PointPairFeature feature = at({3.2, 4.9, 6.4, 8.7});
  EXPECT_THAT(soft(feature, 4), testing::ElementsAre(flat(3, 4, 6, 8), flat(3, 5, 6, 8), flat(2, 4, 6, 8), testing::_));
  const auto four = soft(feature, 4);  // both of the near ones, or the third: each costs 0.3
  EXPECT_THAT(four.back(), testing::AnyOf(flat(2, 5, 6, 8), flat(3, 4, 6, 9)));
}

TEST(SoftBins, LeaveOutBordersBeyondTheirReach) {
  const PointPairFeature feature = at({3.2, 4.9, 6.4, 8.5});
  EXPECT_THAT(soft(feature, 16, 0.15F), testing::ElementsAre(flat(3, 4, 6, 8), flat(3, 5, 6, 8)));
  EXPECT_THAT(soft(feature, 16, 0.0F), testing::ElementsAre(flat(3, 4, 6, 8)));
  EXPECT_EQ(soft(feature, 16, 0.3F).size(), 4U);
}

TEST(SoftBins, EndWhereTheRangesDo) {
  EXPECT_THAT(soft(at({0.2, 0.2, 0.2, 14.8}), 16), testing::ElementsAre(flat(0, 0, 0, 14)));
}

TEST(SoftBins, OfAPairALittleTooLongAreTheLastOnes) {
  EXPECT_THAT(soft(at({12.1, 4.5, 4.5, 4.5}), 1), testing::ElementsAre(flat(11, 4, 4, 4)));
  EXPECT_TRUE(soft(at({12.6, 4.5, 4.5, 4.5}), 16).empty());
  EXPECT_TRUE(soft(at({1000.0, 4.5, 4.5, 4.5}), 16).empty());
}

}  // namespace
}  // namespace asbuilt::detect
