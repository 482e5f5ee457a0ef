// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/pose.h"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace asbuilt {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using std::numbers::pi;

const Vector3d kAxis = Vector3d(2.0, -1.0, 0.5).normalized();

TEST(RotationFromAxisAngle, AgreesWithEigenFromTinyAnglesToAFullTurn) {
  // Eigen builds the matrix from sine and cosine of the angle, another way than ours near zero.
  for (const double angle : {1e-12, 1e-8, 0.99e-4, 1.01e-4, 1e-2, 1.0, pi / 2, pi - 1e-9, pi, 4.0, 2.0 * pi}) {
    const Matrix3d ours = rotation_from_axis_angle(angle * kAxis);
    const Matrix3d expected = AngleAxisd(angle, kAxis).toRotationMatrix();
    EXPECT_LT((ours - expected).cwiseAbs().maxCoeff(), 1e-15 * 4) << "angle " << angle;
  }
}

TEST(RotationFromAxisAngle, OfZeroIsExactlyTheIdentity) {
  EXPECT_EQ(rotation_from_axis_angle(Vector3d::Zero()), Matrix3d::Identity());
}

TEST(RotationFromAxisAngle, HasTheCrossProductAsItsDerivativeAtZero) {
  const Vector3d point(3.0, -2.0, 7.0);
  for (int axis = 0; axis < 3; ++axis) {
    constexpr double kStep = 1e-6;
    const Vector3d numeric = (rotation_from_axis_angle(kStep * Vector3d::Unit(axis)) * point -
                              rotation_from_axis_angle(-kStep * Vector3d::Unit(axis)) * point) /
                             (2.0 * kStep);
    EXPECT_LT((numeric - Vector3d::Unit(axis).cross(point)).norm(), 1e-8);
  }
}

TEST(CrossMatrix, MultipliesAsTheCrossProduct) {
  const Vector3d a(1.0, -2.0, 3.0), b(0.5, 4.0, -1.0);
  EXPECT_TRUE((cross_matrix(a) * b).isApprox(a.cross(b), 1e-15));
}

TEST(PoseFromTwist, TurnsFirstAndThenMoves) {
  Vector6d twist;
  twist << 0.0, 0.0, pi / 2, 10.0, 0.0, 0.0;
  const Vector3d moved = pose_from_twist(twist) * Vector3d(1.0, 0.0, 0.0);
  EXPECT_LT((moved - Vector3d(10.0, 1.0, 0.0)).norm(), 1e-14);
}

TEST(RotationAngle, IsAccurateNearZeroAndNearAHalfTurn) {
  // From the matrix entries an angle x is known to about machine precision absolutely at both ends.
  for (const double angle : {0.0, 1e-14, 1e-9, 1e-4, 0.3, pi / 2, 3.0, pi - 1e-4, pi - 1e-9, pi}) {
    const Matrix3d rotation = AngleAxisd(angle, kAxis).toRotationMatrix();
    EXPECT_NEAR(rotation_angle(rotation), angle, 1e-15 * 4) << "angle " << angle;
  }
}

TEST(Orthonormalised, TakesAwayDriftAndKeepsTheTranslation) {
  Pose pose = Pose::Identity();
  const Matrix3d rotation = rotation_from_axis_angle(1.2 * kAxis);
  pose.linear() = rotation * 1.001;
  pose.translation() = Vector3d(1.0, 2.0, 3.0);
  const Pose clean = orthonormalised(pose);
  EXPECT_LT((clean.linear() - rotation).norm(), 1e-14);  // the polar factor of s R is R
  EXPECT_EQ(clean.translation(), pose.translation());
}

TEST(Orthonormalised, NeverReflects) {
  Pose pose = Pose::Identity();
  pose.linear() = Vector3d(1.0, 1.0, -0.001).asDiagonal();
  EXPECT_NEAR(orthonormalised(pose).linear().determinant(), 1.0, 1e-12);
}

TEST(IsRigid, AcceptsRotationsAndRefusesEverythingElse) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_axis_angle(2.0 * kAxis);
  pose.translation() = Vector3d(1e4, -1e4, 0.0);
  const Eigen::Matrix4d good = pose.matrix();
  EXPECT_TRUE(is_rigid(good));

  Eigen::Matrix4d scaled = good, reflected = good, projective = good, unknown = good;
  scaled.topLeftCorner<3, 3>() *= 1.01;
  reflected.col(0) *= -1.0;
  projective(3, 0) = 0.1;
  unknown(0, 3) = std::numeric_limits<double>::quiet_NaN();
  for (const Eigen::Matrix4d& bad : {scaled, reflected, projective, unknown, Eigen::Matrix4d(good * 0.0)}) {
    EXPECT_FALSE(is_rigid(bad)) << bad;
  }
}

std::vector<Vector3d> some_points() { return {{0, 0, 0}, {4, 0, 0}, {0, 3, 0}, {0, 0, 2}, {1, 1, 1}}; }

Pose some_pose() {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_axis_angle(2.9 * kAxis);
  pose.translation() = Vector3d(-20.0, 5.0, 100.0);
  return pose;
}

std::vector<Vector3d> moved(const std::vector<Vector3d>& points, const Pose& pose) {
  std::vector<Vector3d> result;
  for (const Vector3d& point : points) result.push_back(pose * point);
  return result;
}

TEST(BestRigidMotion, FindsTheMotionOfExactPairs) {
  const std::vector<Vector3d> from = some_points();
  const Pose found = best_rigid_motion(from, moved(from, some_pose()));
  EXPECT_LT((found.matrix() - some_pose().matrix()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(BestRigidMotion, PairsOfNoWeightHaveNoSay) {
  std::vector<Vector3d> from = some_points();
  std::vector<Vector3d> to = moved(from, some_pose());
  to.back() += Vector3d(50.0, 0.0, 0.0);
  const std::vector<double> weights{1.0, 2.0, 3.0, 4.0, 0.0};
  const Pose found = best_rigid_motion(from, to, weights);
  EXPECT_LT((found.matrix() - some_pose().matrix()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(BestRigidMotion, NeverAnswersWithAReflection) {
  // A mirrored, nearly flat set: the best orthogonal matrix would be a mirror.
  const std::vector<Vector3d> from{{0, 0, 0.1}, {4, 0, 0}, {0, 3, 0}, {4, 3, 0.2}, {1, 2, -0.1}};
  std::vector<Vector3d> to;
  for (const Vector3d& point : from) to.emplace_back(point.x(), point.y(), -point.z());
  EXPECT_NEAR(best_rigid_motion(from, to).linear().determinant(), 1.0, 1e-12);
}

TEST(BestRigidMotion, OfPointsInAPlaneIsStillUnique) {
  const std::vector<Vector3d> from{{0, 0, 0}, {4, 0, 0}, {0, 3, 0}};
  const Pose found = best_rigid_motion(from, moved(from, some_pose()));
  EXPECT_LT((found.matrix() - some_pose().matrix()).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(BestRigidMotion, RefusesUnequalNumbersOfPoints) {
  const std::vector<Vector3d> from = some_points();
  EXPECT_THROW((void)best_rigid_motion(from, std::vector<Vector3d>(3)), std::logic_error);
  EXPECT_THROW((void)best_rigid_motion(from, from, std::vector<double>(2)), std::logic_error);
}

}  // namespace
}  // namespace asbuilt
