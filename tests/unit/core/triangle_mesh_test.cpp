// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/triangle_mesh.h"

#include <gtest/gtest.h>

namespace asbuilt {
namespace {

// A right-angled corner of legs 3, 4 and 12, closed by four faces, plus a vertex that no face uses.
TriangleMesh corner_tetrahedron() {
  return {{{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {0, 0, 12}, {100, 100, 100}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(TriangleMesh, DiameterIsTheDiagonalOfTheUsedVertices) {
  EXPECT_DOUBLE_EQ(diameter(corner_tetrahedron()), 13.0);  // 3, 4, 12, 13
}

TEST(TriangleMesh, AreaIsTheSumOfItsFaces) {
  // Three right triangles and the slanted one: half the square root of the squared sum of their doubled areas (de Gua).
  const double slanted = 0.5 * std::sqrt(12.0 * 12.0 + 36.0 * 36.0 + 48.0 * 48.0);
  EXPECT_NEAR(surface_area(corner_tetrahedron()), 6.0 + 18.0 + 24.0 + slanted, 1e-12);
}

TEST(TriangleMesh, AreaVectorsOfAClosedSurfaceAddUpToNothing) {
  const TriangleMesh mesh = corner_tetrahedron();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) sum += doubled_area_vector(mesh, i);
  EXPECT_NEAR(sum.norm(), 0.0, 1e-12);
}

TEST(TriangleMesh, AreaVectorFollowsTheRightHandRule) {
  const TriangleMesh mesh{{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}}, {{0, 1, 2}}};
  EXPECT_TRUE(doubled_area_vector(mesh, 0).isApprox(Eigen::Vector3d(0, 0, 6)));
}

TEST(TriangleMesh, WithoutTrianglesHasNoSize) {
  const TriangleMesh empty;
  EXPECT_TRUE(empty.empty());
  EXPECT_TRUE(bounding_box(empty).isEmpty());
  EXPECT_EQ(diameter(empty), 0.0);
  EXPECT_EQ(surface_area(empty), 0.0);
}

}  // namespace
}  // namespace asbuilt
