// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/evaluate/pose_error.h"
#include "asbuilt/evaluate/surface_error.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/resting.h"
#include "support/parts.h"

namespace asbuilt::evaluate {
namespace {

Pose random_pose(Random& random, double angle, double reach_mm) {
  Vector6d twist;
  for (int k = 0; k < 6; ++k) twist[k] = (k < 3 ? angle : reach_mm) * random.normal();
  return pose_from_twist(twist);
}

TEST(PoseErrorProperty, DoesNotDependOnTheScansFrame) {
  const TriangleMesh model = test::stepped_block();
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed, "frames", 0);
    const Pose truth = random_pose(random, 1.0, 300.0), ours = random_pose(random, 0.01, 1.0) * truth;
    const Pose scan_from_other = random_pose(random, 1.0, 500.0);
    const PoseError before = pose_error(ours, truth, model);
    const PoseError after = pose_error(ours * scan_from_other, truth * scan_from_other, model);
    EXPECT_NEAR(after.add_mm, before.add_mm, 1e-8);
    EXPECT_NEAR(after.max_vertex_mm, before.max_vertex_mm, 1e-8);
    EXPECT_NEAR(after.angle_deg, before.angle_deg, 1e-8);
    EXPECT_LE(before.add_mm, before.max_vertex_mm);
  }
}

TEST(AlignmentProperty, TheThreadCountNeverShowsAndTheMeanDistanceNeverGrows) {
  const TriangleMesh mesh = test::casing();
  const model::SurfaceDistance surface(mesh);
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Random random(seed, "alignment", 0);
    const Pose moved = random_pose(random, 0.01, 2.0);
    std::vector<Eigen::Vector3d> points;
    for (const auto& sample : simulate::area_samples(mesh, 3000, Random(seed, "points", 0))) {
      points.push_back(moved * (sample.position + 0.1 * random.normal() * sample.normal));
    }
    const Pose one = best_motion_onto(points, mesh, surface, 0.1, Pose::Identity(), Context(1));
    for (const int threads : {2, 3}) {
      const Pose more = best_motion_onto(points, mesh, surface, 0.1, Pose::Identity(), Context(threads));
      EXPECT_EQ(more.matrix(), one.matrix());
    }
    std::vector<Eigen::Vector3d> aligned = points;
    for (Eigen::Vector3d& point : aligned) point = one * point;
    const double before = mean_surface_distance(points, surface, Context(2));
    const double after = mean_surface_distance(aligned, surface, Context(2));
    EXPECT_LT(after, before);
    EXPECT_NEAR(after, 0.1 * std::sqrt(2.0 / 3.14159265358979), 0.005);  // E|x| of the noise
  }
}

}  // namespace
}  // namespace asbuilt::evaluate
