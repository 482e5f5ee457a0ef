// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/surface_error.h"

#include <gtest/gtest.h>

#include <limits>

#include "asbuilt/simulate/mesh_edit.h"
#include "support/matchers.h"
#include "support/parts.h"
#include "unit/evaluate/surface_points.h"

namespace asbuilt::evaluate {
namespace {

TEST(SurfaceError, MeanDistanceCountsAllFinitePointsOnBothSides) {
  const model::SurfaceDistance surface(simulate::box({20, 20, 20}));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Eigen::Vector3f> points{{0, 0, 12}, {0, 0, 9}, {0, 0, 110}, {nan, 0, 0}};
  const Pose shifted(Eigen::Translation3d(0, 0, 1));
  EXPECT_NEAR(mean_surface_distance(points, Pose::Identity(), surface, Context(2)), (2.0 + 1.0 + 100.0) / 3.0, 1e-9);
  EXPECT_NEAR(mean_surface_distance(points, shifted, surface, Context(2)), (3.0 + 0.0 + 101.0) / 3.0, 1e-9);
  EXPECT_EQ(mean_surface_distance(std::vector<Eigen::Vector3f>{}, shifted, surface, Context(1)), 0.0);
}

TEST(SurfaceError, AlignmentUndoesAMotionExactly) {
  const TriangleMesh mesh = test::stepped_block();
  const model::SurfaceDistance surface(mesh);
  Vector6d twist;
  twist << 0.02, -0.03, 0.01, 2.0, -1.0, 1.5;
  const Pose moved = pose_from_twist(twist);
  std::vector<Eigen::Vector3d> points = test::surface_points(mesh, 5000);
  for (Eigen::Vector3d& point : points) point = moved * point;
  const Pose found = best_motion_onto(points, mesh, surface, 0.1, Pose::Identity(), Context(2));
  EXPECT_THAT(found, test::PoseNear(moved.inverse(), 1e-4, 1e-4));
}

TEST(SurfaceError, AlignmentIsNotBentByAFewPointsFarOff) {
  const TriangleMesh mesh = test::stepped_block();
  const model::SurfaceDistance surface(mesh);
  std::vector<Eigen::Vector3d> points = test::surface_points(mesh, 4000);
  for (std::size_t i = 0; i < 100; ++i) points[40 * i] += Eigen::Vector3d(0, 0, 30.0);
  const Pose found = best_motion_onto(points, mesh, surface, 0.05, Pose::Identity(), Context(2));
  EXPECT_THAT(found, test::PoseNear(Pose::Identity(), 0.01, 0.01));  // least squares would shift by 0.5 mm and more
}

TEST(SurfaceError, AlignmentOfAPlanesPointsStaysFinite) {
  const TriangleMesh mesh = simulate::box({200, 200, 1});
  const model::SurfaceDistance surface(mesh);
  std::vector<Eigen::Vector3d> points;
  for (int i = -5; i <= 5; ++i) {
    for (int j = -5; j <= 5; ++j) points.emplace_back(i, j, 2.0);
  }
  const Pose found = best_motion_onto(points, mesh, surface, 0.1, Pose::Identity(), Context(1));
  EXPECT_THAT(found, test::PoseNear(Pose(Eigen::Translation3d(0, 0, -1.5)), 1e-3, 1e-3));
}

}  // namespace
}  // namespace asbuilt::evaluate
