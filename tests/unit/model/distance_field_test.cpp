// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/distance_field.h"

#include <gtest/gtest.h>

#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

struct Part {
  TriangleMesh mesh;
  SurfaceDistance surface;
  DistanceField field;

  Part(const TriangleMesh& source, double voxel, double reach, const Context& context = Context(2))
      : mesh(source), surface(mesh), field(mesh, surface, voxel, reach, context) {}
};

TEST(DistanceField, IsExactNextToAPlane) {
  const Part part(test::joined(test::box({0, 0, 0}, {100, 100, 100})), 1.0, 10.0);
  Random random(1, "plane", 0);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3f p(static_cast<float>(random.uniform(20, 80)), static_cast<float>(random.uniform(20, 80)),
                            static_cast<float>(random.uniform(92, 108)));
    const DistanceField::Sample sample = part.field.at(p);
    ASSERT_TRUE(sample.known());
    ASSERT_NEAR(sample.distance, p.z() - 100.0F, 1e-4F);
    ASSERT_NEAR((sample.gradient - Eigen::Vector3f::UnitZ()).norm(), 0.0F, 1e-4F);
    ASSERT_GT(doubled_area_vector(part.mesh, static_cast<std::size_t>(sample.triangle)).z(), 0.0);
  }
}

TEST(DistanceField, StaysWithinAVoxelOfTheTruthNearTheSurfaceOfASphere) {
  const Part part(test::sphere({0, 0, 0}, 50.0, 5), 1.0, 20.0);
  Random random(2, "sphere", 0);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p = test::random_point(random, -68, 68);
    const double truth = p.norm() - 50.0;
    const DistanceField::Sample sample = part.field.at(p.cast<float>());
    if (std::abs(truth) < 4.0) {
      ASSERT_TRUE(sample.known());
      // The largest facets' middles lie 0.04 inside the ball; curvature over a voxel adds 3 h^2 / (8 r) = 0.0075.
      ASSERT_NEAR(sample.distance, truth, 0.05);
      ASSERT_GT(sample.gradient.dot(p.cast<float>().normalized()), 0.97F);  // facets and the mean over a voxel tilt it
    } else if (std::abs(truth) < 20.0) {
      ASSERT_TRUE(sample.known());
      ASSERT_NEAR(sample.distance, truth, 0.2);  // coarse grid: sixteen times the curvature's part
    }
  }
}

TEST(DistanceField, TheDistanceAloneIsThatOfTheWholeSample) {
  const Part part(test::joined(test::box({0, 0, 0}, {100, 100, 100})), 1.0, 10.0);
  Random random(5, "alone", 0);
  for (int i = 0; i < 3000; ++i) {  // near, in the coarse grid, and beyond the reach
    const Eigen::Vector3f p(static_cast<float>(random.uniform(-30, 130)), static_cast<float>(random.uniform(-30, 130)),
                            static_cast<float>(random.uniform(-30, 130)));
    ASSERT_EQ(part.field.distance_at(p), part.field.at(p).distance) << p.transpose();
  }
}

TEST(DistanceField, IsUnknownFarAway) {
  const Part part(test::joined(test::box({0, 0, 0}, {10, 10, 10})), 0.5, 3.0);
  for (const Eigen::Vector3f& p :
       {Eigen::Vector3f(100, 0, 0), Eigen::Vector3f(-1e30F, 0, 0), Eigen::Vector3f(std::nanf(""), 0, 0),
        Eigen::Vector3f(std::numeric_limits<float>::infinity(), 0, 0)}) {
    const DistanceField::Sample sample = part.field.at(p);
    EXPECT_FALSE(sample.known());
    EXPECT_EQ(sample.distance, std::numeric_limits<float>::infinity());
    EXPECT_EQ(sample.gradient, Eigen::Vector3f::Zero());
  }
}

TEST(DistanceField, NamesAFaceThatIsNearlyNearest) {
  const Part part(test::sphere({0, 0, 0}, 50.0, 4), 1.0, 10.0);
  Random random(3, "face", 0);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d p = test::random_point(random, -1, 1).normalized() * random.uniform(46.5, 53.5);
    const DistanceField::Sample sample = part.field.at(p.cast<float>());
    TriangleMesh face{part.mesh.vertices, {part.mesh.triangles[static_cast<std::size_t>(sample.triangle)]}};
    const double there = std::abs(SurfaceDistance(face).nearest(p).signed_distance);
    // The nearest node is at most half a voxel's diagonal away, which both distances can differ by.
    ASSERT_LE(there, std::abs(part.surface.nearest(p).signed_distance) + std::sqrt(3.0) + 1e-5);
  }
}

TEST(DistanceField, SeesThroughAThinWallToItsNearerSide) {
  // A plate 1.2 voxels thick: both sides keep their zero and their direction.
  const Part part(test::joined(test::box({0, 0, 0}, {60, 60, 1.2}, 4)), 1.0, 8.0);
  for (const float z : {-3.0F, -1.0F, -0.4F}) {
    EXPECT_NEAR(part.field.at({31, 29, z}).distance, -z, 0.25F);
    EXPECT_LT(part.field.at({31, 29, z}).gradient.z(), -0.5F);
  }
  for (const float z : {1.6F, 2.2F, 5.0F}) {
    EXPECT_NEAR(part.field.at({31, 29, z}).distance, z - 1.2F, 0.25F);
    EXPECT_GT(part.field.at({31, 29, z}).gradient.z(), 0.5F);
  }
}

TEST(DistanceField, IsNoNearerThanItIsBeyondTheBorderOfASheet) {
  // Beyond the border of an open sheet the sign jumps across its plane. Interpolated as it is, the field would pass
  // through zero there, a surface out of nothing.
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {20, 0, 0}, {20, 20, 0}, {0, 20, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const Part part(sheet, 1.0, 15.0);
  Random random(4, "sheet", 0);
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d p(random.uniform(21.5, 30.0), random.uniform(2, 18), random.uniform(-3, 3));
    const double truth = std::abs(part.surface.nearest(p).signed_distance);
    // Half the coarse voxel: near the border itself the sheet's own sign change remains.
    ASSERT_NEAR(std::abs(part.field.at(p.cast<float>()).distance), truth, truth > 4.0 ? 0.6 : 0.9) << p.transpose();
  }
}

TEST(DistanceField, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh mesh = test::sphere({0, 0, 0}, 50.0, 4);
  const Part one(mesh, 1.5, 12.0, Context(1)), two(mesh, 1.5, 12.0, Context(2)), three(mesh, 1.5, 12.0, Context(3));
  Random random(5, "threads", 0);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f p = test::random_point(random, -65, 65).cast<float>();
    for (const Part* other : {&two, &three}) {
      ASSERT_EQ(other->field.at(p).distance, one.field.at(p).distance);
      ASSERT_EQ(other->field.at(p).gradient, one.field.at(p).gradient);
      ASSERT_EQ(other->field.at(p).triangle, one.field.at(p).triangle);
    }
  }
}

TEST(DistanceField, HoldsForAPartFarFromTheOrigin) {
  const Eigen::Vector3d offset(20000, -30000, 10000);
  const Part part(test::sphere(offset, 50.0, 4), 1.0, 10.0);
  for (const double r : {47.0, 50.0, 53.0}) {
    const Eigen::Vector3d p = offset + r * Eigen::Vector3d(0.6, 0.64, 0.48);
    EXPECT_NEAR(part.field.at(p.cast<float>()).distance, part.surface.nearest(p).signed_distance, 0.05);
  }
}

TEST(DistanceField, SaysHowMuchMemoryItTakes) {
  const TriangleMesh mesh = test::sphere({0, 0, 0}, 50.0, 4);
  EXPECT_LT(Part(mesh, 2.0, 5.0).field.memory_bytes(), Part(mesh, 1.0, 5.0).field.memory_bytes());
  EXPECT_LT(Part(mesh, 1.0, 20.0).field.memory_bytes(), 30e6);
}

TEST(DistanceField, RefusesAVoxelThatMakesNoSense) {
  const TriangleMesh mesh = test::sphere({0, 0, 0}, 50.0, 1);
  const SurfaceDistance surface(mesh);
  EXPECT_THROW(DistanceField(mesh, surface, 0.0, 1.0, Context(1)), std::logic_error);
  EXPECT_THROW(DistanceField(mesh, surface, std::nan(""), 1.0, Context(1)), std::logic_error);
  EXPECT_THROW(DistanceField(mesh, surface, 1e-4, 1.0, Context(1)), std::logic_error);  // would need terabytes
}

}  // namespace
}  // namespace asbuilt::model
