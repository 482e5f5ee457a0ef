// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/ray_scene.h"

#include <gtest/gtest.h>

#include <vector>

#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(RayScene, FindsTheNearSideOfABoxAndItsTriangle) {
  const TriangleMesh mesh = test::box({0, 0, 0}, {10, 20, 30});
  const RayScene scene(mesh);
  const RayScene::Hit hit = scene.first_hit({3, 5, 100}, {0, 0, -1});
  ASSERT_TRUE(hit.found());
  EXPECT_NEAR(hit.distance, 70.0, 1e-4);
  EXPECT_EQ(doubled_area_vector(mesh, hit.triangle).normalized(), Eigen::Vector3d::UnitZ());
}

TEST(RayScene, MeasuresInLengthsOfTheDirection) {
  const RayScene scene(test::box({0, 0, 0}, {10, 20, 30}));
  EXPECT_NEAR(scene.first_hit({3, 5, 100}, {0, 0, -2}).distance, 35.0, 1e-4);
}

TEST(RayScene, MissesWhatIsNotInTheWay) {
  const RayScene scene(test::box({0, 0, 0}, {10, 20, 30}));
  EXPECT_FALSE(scene.first_hit({3, 5, 100}, {0, 0, 1}).found());
  EXPECT_FALSE(scene.first_hit({30, 5, 100}, {0, 0, -1}).found());
}

TEST(RayScene, ObeysNearAndFar) {
  const RayScene scene(test::box({0, 0, 0}, {10, 20, 30}));
  EXPECT_NEAR(scene.first_hit({3, 5, 100}, {0, 0, -1}, 71.0).distance, 100.0, 1e-4);
  EXPECT_FALSE(scene.first_hit({3, 5, 100}, {0, 0, -1}, 0.0, 69.0).found());
  EXPECT_FALSE(scene.is_blocked({3, 5, 100}, {0, 0, -1}, 0.0, 69.0));
  EXPECT_TRUE(scene.is_blocked({3, 5, 100}, {0, 0, -1}, 0.0, 71.0));
  EXPECT_FALSE(scene.is_blocked({3, 5, 100}, {0, 0, -1}, 101.0, kInfinity));
}

TEST(RayScene, TellsTheMeshesApart) {
  const std::vector<TriangleMesh> meshes{test::box({0, 0, 0}, {1, 1, 1}), TriangleMesh{},
                                         test::box({5, 0, 0}, {6, 1, 1})};
  const RayScene scene(meshes);
  EXPECT_EQ(scene.first_hit({0.3, 0.4, 9}, {0, 0, -1}).mesh, 0U);
  EXPECT_EQ(scene.first_hit({5.3, 0.4, 9}, {0, 0, -1}).mesh, 2U);
}

TEST(RayScene, GivesTheLowerTriangleWhereTwoAreEquallyFar) {
  TriangleMesh mesh = test::box({0, 0, 0}, {8, 8, 8});
  for (int turn = 0; turn < 2; ++turn) {
    const RayScene scene(mesh);
    const RayScene::Hit on_diagonal = scene.first_hit({4, 4, 20}, {0, 0, -1});
    std::uint32_t lowest = 0;
    while (doubled_area_vector(mesh, lowest).z() <= 0.0) ++lowest;
    EXPECT_EQ(on_diagonal.triangle, lowest);
    std::ranges::reverse(mesh.triangles);
  }
}

TEST(RayScene, KeepsItsPrecisionFarFromTheOrigin) {
  const Eigen::Vector3d offset(4e6, 5e6, 1e5);  // a surveyor's coordinates, in mm
  const RayScene scene(test::box(offset, offset + Eigen::Vector3d(10, 20, 30)));
  EXPECT_NEAR(scene.first_hit(offset + Eigen::Vector3d(3, 5, 100), {0, 0, -1}).distance, 70.0, 1e-3);
}

TEST(RayScene, IsEmptyForAnEmptyMesh) {
  const RayScene scene{TriangleMesh{}};
  EXPECT_FALSE(scene.first_hit({0, 0, 0}, {0, 0, 1}).found());
  EXPECT_FALSE(scene.is_blocked({0, 0, 0}, {0, 0, 1}, 0.0, kInfinity));
}

TEST(RayScene, HitsNothingWithRaysThatAreNotNumbers) {
  const RayScene scene(test::box({0, 0, 0}, {1, 1, 1}));
  EXPECT_FALSE(scene.first_hit({std::nan(""), 0, 5}, {0, 0, -1}).found());
  EXPECT_FALSE(scene.is_blocked({0.5, 0.5, 5}, {0, kInfinity, -1}, 0.0, kInfinity));
}

TEST(RayScene, SurvivesBeingMoved) {
  RayScene first(test::box({0, 0, 0}, {1, 1, 1}));
  const RayScene second = std::move(first);
  EXPECT_TRUE(second.first_hit({0.3, 0.4, 5}, {0, 0, -1}).found());
}

}  // namespace
}  // namespace asbuilt::model
