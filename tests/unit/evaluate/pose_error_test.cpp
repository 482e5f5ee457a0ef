// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/pose_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/parts.h"

namespace asbuilt::evaluate {
namespace {

Pose translation(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

Pose about_z(double degrees) {
  return Pose(Eigen::AngleAxisd(degrees / 180.0 * std::numbers::pi, Eigen::Vector3d::UnitZ()));
}

TEST(PoseError, OfTheTruePoseIsZero) {
  const Pose pose = translation(100, -50, 700) * about_z(33.0);
  const PoseError error = pose_error(pose, pose, test::stepped_block());
  EXPECT_NEAR(error.angle_deg, 0.0, 1e-6);
  EXPECT_NEAR(error.max_vertex_mm, 0.0, 1e-9);
}

TEST(PoseError, OfATranslationIsItsLengthEverywhere) {
  const Pose truth = translation(100, -50, 700) * about_z(33.0);
  const PoseError error = pose_error(translation(2, 3, 6) * truth, truth, test::stepped_block());
  EXPECT_NEAR(error.angle_deg, 0.0, 1e-6);
  EXPECT_NEAR(error.translation_mm, 7.0, 1e-9);
  EXPECT_NEAR(error.add_mm, 7.0, 1e-9);
  EXPECT_NEAR(error.max_vertex_mm, 7.0, 1e-9);
}

TEST(PoseError, OfATurnGrowsWithTheDistanceFromTheAxis) {
  const TriangleMesh mesh = simulate::box({60, 80, 10});  // all corners 50 mm from the axis
  const PoseError error = pose_error(about_z(4.0), Pose::Identity(), mesh);
  const double chord = 2.0 * 50.0 * std::sin(2.0 / 180.0 * std::numbers::pi);
  EXPECT_NEAR(error.angle_deg, 4.0, 1e-9);
  EXPECT_NEAR(error.translation_mm, 0.0, 1e-9);
  EXPECT_NEAR(error.add_mm, chord, 1e-9);
  EXPECT_NEAR(error.max_vertex_mm, chord, 1e-9);
}

TEST(PoseError, ASymmetricPartMayBeTurnedByItsSymmetry) {
  const TriangleMesh mesh = simulate::box({60, 80, 10});
  const std::vector<Pose> symmetries{Pose::Identity(), about_z(180.0)};
  const Pose truth = translation(1, 2, 3) * about_z(20.0);
  const Pose ours = translation(0.5, 0, 0) * about_z(180.0) * truth;
  EXPECT_GT(pose_error(ours, truth, mesh).max_vertex_mm, 90.0);
  const PoseError error = pose_error(ours, truth, mesh, symmetries);
  EXPECT_NEAR(error.max_vertex_mm, 0.5, 1e-9);
  EXPECT_EQ(error.symmetry, 1U);
}

TEST(PoseError, VerticesOutsideTheSurfaceDoNotCount) {
  TriangleMesh mesh = simulate::box({60, 80, 10});
  mesh.vertices.emplace_back(1e6, 0, 0);
  EXPECT_LT(pose_error(about_z(1.0), Pose::Identity(), mesh).max_vertex_mm, 1.0);
}

}  // namespace
}  // namespace asbuilt::evaluate
