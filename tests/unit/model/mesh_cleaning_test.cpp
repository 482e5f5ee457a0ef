// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/mesh_cleaning.h"

#include <gtest/gtest.h>

#include "asbuilt/model/mesh_edges.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

TriangleMesh soup_of(const TriangleMesh& mesh) {
  TriangleMesh soup;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const int base = static_cast<int>(soup.vertices.size());
    for (int k = 0; k < 3; ++k) soup.vertices.push_back(mesh.vertices[static_cast<std::size_t>(t[k])]);
    soup.triangles.emplace_back(base, base + 1, base + 2);
  }
  return soup;
}

TEST(MeshCleaning, WeldsASoupIntoAClosedMesh) {
  const TriangleMesh sphere = test::sphere({5, -3, 2}, 4.0, 4);
  const CleanedMesh result = cleaned(soup_of(sphere), 1e-6);
  EXPECT_EQ(result.mesh.vertices.size(), sphere.vertices.size());
  EXPECT_EQ(result.mesh.triangles.size(), sphere.triangles.size());
  EXPECT_EQ(result.vertices_welded, 3 * sphere.triangles.size() - sphere.vertices.size());
  EXPECT_EQ(count_open_edges(result.mesh), 0U);
}

TEST(MeshCleaning, WeldsAcrossTheBordersOfItsOwnGrid) {
  // Copies of each corner, shifted by less than the tolerance in random directions, all over the place.
  Random random(3, "weld", 0);
  TriangleMesh soup = soup_of(test::sphere({0, 0, 0}, 4.0, 3));
  const double tolerance = 1e-3;
  for (Eigen::Vector3d& vertex : soup.vertices) vertex += test::random_point(random, -0.28, 0.28) * tolerance;
  EXPECT_EQ(cleaned(soup, tolerance).mesh.vertices.size(), test::sphere({0, 0, 0}, 4.0, 3).vertices.size());
}

TEST(MeshCleaning, LeavesVerticesApartThatAreFurtherThanTheTolerance) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1.0011, 0, 0}, {2, 2, 2}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 2}};
  EXPECT_EQ(cleaned(mesh, 1e-3).vertices_welded, 0U);
  EXPECT_EQ(cleaned(mesh, 1.2e-3).vertices_welded, 1U);
}

TEST(MeshCleaning, DropsTrianglesWithoutHeight) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}, {0.5, 1e-9, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {0, 0, 2}};
  const CleanedMesh result = cleaned(mesh, 1e-6);
  EXPECT_EQ(result.degenerate_dropped, 3U);
  EXPECT_EQ(result.mesh.triangles.size(), 1U);
}

TEST(MeshCleaning, KeepsTheFirstOfTrianglesWithTheSameCorners) {
  TriangleMesh mesh = test::joined(test::box({0, 0, 0}, {1, 1, 1}));
  const Eigen::Vector3i first = mesh.triangles[0];
  mesh.triangles.emplace_back(first[1], first[2], first[0]);  // turned round
  mesh.triangles.emplace_back(first[0], first[2], first[1]);  // and over
  const CleanedMesh result = cleaned(mesh, 1e-6);
  EXPECT_EQ(result.duplicates_dropped, 2U);
  EXPECT_EQ(result.mesh.triangles.size(), 12U);
  EXPECT_GT(test::sixfold_volume(result.mesh), 5.9);
}

TEST(MeshCleaning, SubsetKeepsOnlyTheVerticesInUse) {
  const TriangleMesh mesh = test::box({0, 0, 0}, {1, 1, 1});
  std::vector<std::uint8_t> keep(12, 0);
  keep[7] = 1;
  const TriangleMesh one = subset(mesh, keep);
  ASSERT_EQ(one.triangles.size(), 1U);
  EXPECT_EQ(one.vertices.size(), 3U);
  EXPECT_EQ(doubled_area_vector(one, 0), doubled_area_vector(mesh, 7));
}

}  // namespace
}  // namespace asbuilt::model
