// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "asbuilt/model/distance_field.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

TriangleMesh lumpy_part() {
  return test::joined(test::together(test::sphere({0, 0, 0}, 20.0, 3), test::box({10, -6, -6}, {45, 6, 6}, 3)));
}

TEST(DistanceFieldProperty, StaysWithinAVoxelOfTheExactDistance) {
  const TriangleMesh mesh = lumpy_part();
  const SurfaceDistance surface(mesh);
  const double voxel = 0.4;
  const DistanceField field(mesh, surface, voxel, 8.0, Context(2));
  Random random(1, "field", 0);
  int near = 0;
  for (int i = 0; i < 40000; ++i) {
    const Eigen::Vector3d p(random.uniform(-27, 52), random.uniform(-27, 27), random.uniform(-27, 27));
    const double truth = std::abs(surface.nearest(p).signed_distance);
    const DistanceField::Sample sample = field.at(p.cast<float>());
    if (truth < 4.0 * voxel) {
      ++near;
      ASSERT_TRUE(sample.known());
      // A trilinear mean of values each within half a diagonal's length of the truth, by 1-Lipschitz continuity.
      ASSERT_NEAR(std::abs(sample.distance), truth, std::sqrt(3.0) / 2.0 * voxel + 1e-4);
    } else if (truth < 8.0) {
      ASSERT_TRUE(sample.known());
      ASSERT_NEAR(std::abs(sample.distance), truth, 4.0 * std::sqrt(3.0) / 2.0 * voxel + 1e-4);
    }
  }
  EXPECT_GT(near, 2000);
}

TEST(DistanceFieldProperty, GradientIsTheDerivativeOfTheDistance) {
  const TriangleMesh mesh = lumpy_part();
  const SurfaceDistance surface(mesh);
  const DistanceField field(mesh, surface, 0.5, 6.0, Context(2));
  Random random(2, "gradient", 0);
  int checked = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f p = Eigen::Vector3f(test::random_point(random, -25, 25).cast<float>());
    const DistanceField::Sample sample = field.at(p);
    if (!sample.known()) continue;
    // The interpolant is linear along each axis within a cell, so a difference within the cell is exact. A step that
    // leaves it meets another slope: such probes show as one-sided differences that disagree and are left out.
    const float h = 0.01F;
    bool is_inside_cell = true;
    Eigen::Vector3f difference;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3f step = h * Eigen::Vector3f::Unit(axis);
      const float before = field.at(p - step).distance, after = field.at(p + step).distance;
      is_inside_cell = is_inside_cell && std::abs(after - 2.0F * sample.distance + before) < 2e-5F;
      difference[axis] = (after - before) / (2.0F * h);
    }
    if (!is_inside_cell) continue;
    ++checked;
    ASSERT_NEAR((difference - sample.gradient).norm(), 0.0F, 3e-3F);  // float cancellation: 1e-5 / (2 h)
  }
  EXPECT_GT(checked, 3000);
}

TEST(DistanceFieldProperty, DistanceIsContinuousAcrossCellsAndBricks) {
  // Two bodies that do not meet: the signed distance of overlapping ones does jump, inside.
  const TriangleMesh mesh =
      test::joined(test::together(test::sphere({0, 0, 0}, 20.0, 3), test::box({21, -6, -6}, {45, 6, 6}, 3)));
  const SurfaceDistance surface(mesh);
  const DistanceField field(mesh, surface, 0.5, 6.0, Context(2));
  Random random(3, "continuity", 0);
  for (int line = 0; line < 200; ++line) {
    const Eigen::Vector3d start = test::random_point(random, -1, 1).normalized() * 20.0;
    const Eigen::Vector3d direction = test::random_point(random, -1, 1).normalized();
    float before = 0.0F;
    for (int i = 0; i < 160; ++i) {  // stays within the fine grid's band
      const Eigen::Vector3f p = (start + 0.01 * i * direction).cast<float>();
      const DistanceField::Sample sample = field.at(p);
      ASSERT_TRUE(sample.known());
      if (i > 0) {
        ASSERT_LT(std::abs(sample.distance - before), 0.01F * 1.8F);  // slope at most sqrt(3)
      }
      before = sample.distance;
    }
  }
}

}  // namespace
}  // namespace asbuilt::model
