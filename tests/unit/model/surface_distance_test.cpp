// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/surface_distance.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

// The exact signed distance to an axis-aligned box.
double box_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const Eigen::Vector3d outside = (low - p).cwiseMax(p - high);
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0);
}

TEST(SurfaceDistance, AgreesWithTheFormulaOfABoxInsideAndOut) {
  const Eigen::Vector3d low(-3, -4, -5), high(6, 7, 8);
  const SurfaceDistance surface(test::joined(test::box(low, high, 3)));
  Random random(1, "test", 0);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p = test::random_point(random, -15, 15);
    const auto nearest = surface.nearest(p);
    EXPECT_NEAR(nearest.signed_distance, box_distance(p, low, high), 1e-12) << p.transpose();
    EXPECT_NEAR((p - nearest.point).norm(), std::abs(nearest.signed_distance), 1e-12);
    EXPECT_FALSE(nearest.on_open_edge);
  }
}

TEST(SurfaceDistance, HasTheRightSignNextToSharpEdgesWhereFaceNormalsDisagree) {
  // A flat wedge: near its edge and corners most nearby face normals give the wrong sign.
  TriangleMesh wedge;
  wedge.vertices = {{0, 0, 0}, {10, 0, 0}, {5, 0.2, 0}, {5, 0.1, 9}};
  wedge.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  ASSERT_GT(test::sixfold_volume(wedge), 0.0);
  const SurfaceDistance surface(wedge);
  Random random(2, "test", 0);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p(random.uniform(-2, 12), random.uniform(-1, 1), random.uniform(-2, 11));
    bool is_inside = true;  // a convex body: behind all its planes
    for (std::size_t t = 0; t < 4; ++t) {
      const auto corner = static_cast<std::size_t>(wedge.triangles[t][0]);
      is_inside = is_inside && doubled_area_vector(wedge, t).dot(p - wedge.vertices[corner]) < 0.0;
    }
    inside += is_inside ? 1 : 0;
    EXPECT_EQ(surface.nearest(p).signed_distance < 0.0, is_inside) << p.transpose();
  }
  EXPECT_GT(inside, 100);
}

TEST(SurfaceDistance, IsZeroOnTheSurfaceItself) {
  const TriangleMesh mesh = test::sphere({1, 2, 3}, 5.0, 3);
  const SurfaceDistance surface(mesh);
  for (const Eigen::Vector3d& vertex : mesh.vertices) EXPECT_EQ(surface.nearest(vertex).signed_distance, 0.0);
}

TEST(SurfaceDistance, GivesEqualDistancesToTheLowerTriangle) {
  TriangleMesh mesh = test::joined(test::box({-1, -1, -1}, {1, 1, 1}));
  for (int turn = 0; turn < 2; ++turn) {
    const SurfaceDistance surface(mesh);
    EXPECT_EQ(surface.nearest({0, 0, 0}).triangle, 0U);  // all twelve are one away
    const Eigen::Vector3d beyond_corner(3, 3, 3);
    std::uint32_t lowest = 0;
    const auto touches_corner = [&](const Eigen::Vector3i& t) {
      for (int k = 0; k < 3; ++k) {
        if (mesh.vertices[static_cast<std::size_t>(t[k])] == Eigen::Vector3d(1, 1, 1)) return true;
      }
      return false;
    };
    while (!touches_corner(mesh.triangles[lowest])) ++lowest;
    EXPECT_EQ(surface.nearest(beyond_corner).triangle, lowest);
    std::ranges::reverse(mesh.triangles);
  }
}

TEST(SurfaceDistance, SaysWhenTheNearestPointIsOnTheBorderOfAnOpenMesh) {
  TriangleMesh sheet;
  sheet.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const SurfaceDistance surface(sheet);
  EXPECT_TRUE(surface.nearest({-1, 2, 1}).on_open_edge);   // an edge
  EXPECT_TRUE(surface.nearest({-1, -1, 1}).on_open_edge);  // a corner
  EXPECT_FALSE(surface.nearest({2, 2, 1}).on_open_edge);   // the inner edge has both its faces
  EXPECT_FALSE(surface.nearest({1, 2, 1}).on_open_edge);
  EXPECT_EQ(surface.nearest({1, 2, 1}).signed_distance, 1.0);
  EXPECT_EQ(surface.nearest({1, 2, -1}).signed_distance, -1.0);
}

TEST(SurfaceDistance, FindsNothingBeyondTheReachAndAllWithinIt) {
  const SurfaceDistance surface(test::joined(test::box({-1, -1, -1}, {1, 1, 1})));
  EXPECT_FALSE(surface.nearest({0, 0, 3}, 1.999).found());
  EXPECT_TRUE(surface.nearest({0, 0, 3}, 2.0).found());
  EXPECT_TRUE(surface.nearest({0, 0, 1}, 0.0).found());
  EXPECT_FALSE(surface.nearest({0, 0, 3}, -1.0).found());
}

TEST(SurfaceDistance, FindsNothingForAPointThatIsNotANumberOrAnEmptyMesh) {
  const SurfaceDistance surface(test::box({-1, -1, -1}, {1, 1, 1}));
  EXPECT_FALSE(surface.nearest({std::nan(""), 0, 0}).found());
  EXPECT_FALSE(surface.nearest({0, 0, 0}, std::nan("")).found());
  EXPECT_FALSE(SurfaceDistance(TriangleMesh{}).nearest({0, 0, 0}).found());
}

TEST(SurfaceDistance, RefusesAMeshWithImpossibleNumbers) {
  TriangleMesh mesh = test::box({-1, -1, -1}, {1, 1, 1});
  mesh.triangles[3][1] = static_cast<int>(mesh.vertices.size());
  EXPECT_THROW(SurfaceDistance{mesh}, std::logic_error);
  mesh = test::box({-1, -1, -1}, {1, 1, 1});
  mesh.vertices[5].y() = std::nan("");
  EXPECT_THROW(SurfaceDistance{mesh}, std::logic_error);
}

TEST(SurfaceDistance, TakesTrianglesWithoutAreaAsTheSegmentsTheyAre) {
  TriangleMesh needle;
  needle.vertices = {{0, 0, 0}, {10, 0, 0}, {5, 0, 0}};
  needle.triangles = {{0, 1, 2}};
  const auto nearest = SurfaceDistance(needle).nearest({7, 3, 4});
  EXPECT_DOUBLE_EQ(std::abs(nearest.signed_distance), 5.0);
  EXPECT_EQ(nearest.point, Eigen::Vector3d(7, 0, 0));
}

}  // namespace
}  // namespace asbuilt::model
