// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/mesh_clean.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>

namespace asbuilt::fuse {
namespace {

// Two tetrahedra that touch along the edge from vertex 0 to vertex 1.
TriangleMesh two_that_share_an_edge() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {1, 1, 0}, {-1, 0, 0}, {-1, -1, 0}};
  mesh.triangles = {{0, 3, 2}, {0, 1, 3}, {1, 2, 3}, {0, 2, 1}, {0, 5, 4}, {0, 1, 5}, {1, 4, 5}, {0, 4, 1}};
  return mesh;
}

int most_on_an_edge(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;
  int most = 0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) most = std::max(most, ++uses[std::minmax(t[k], t[(k + 1) % 3])]);
  }
  return most;
}

double volume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    sum += mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][0])].dot(doubled_area_vector(mesh, t)) / 6.0;
  }
  return sum;
}

TEST(MeshClean, AnEdgeOfFourTrianglesBecomesTwoOfTwo) {
  TriangleMesh mesh = two_that_share_an_edge();
  ASSERT_EQ(most_on_an_edge(mesh), 4);
  const double area = surface_area(mesh), before = volume(mesh);
  ASSERT_NEAR(before, 2.0 / 6.0, 1e-12);
  separate_shared_edges(mesh);
  EXPECT_EQ(most_on_an_edge(mesh), 2);
  EXPECT_NEAR(surface_area(mesh), area, 1e-12) << "nothing is lost";
  EXPECT_NEAR(volume(mesh), before, 1e-12) << "nothing moves or turns over";
}

TEST(MeshClean, AMeshWithoutSharedEdgesStaysAsItIs) {
  TriangleMesh mesh = two_that_share_an_edge();
  mesh.triangles.resize(4);
  const TriangleMesh before = mesh;
  separate_shared_edges(mesh);
  EXPECT_EQ(mesh.vertices, before.vertices);
  EXPECT_EQ(mesh.triangles, before.triangles);
}

TEST(MeshClean, SmallPiecesGoWithTheirVertices) {
  TriangleMesh mesh = two_that_share_an_edge();
  mesh.triangles.resize(4);
  mesh.triangles.push_back({0, 5, 4});  // touches the rest at a vertex only
  const TriangleMesh kept = without_small_pieces(mesh, 2);
  EXPECT_EQ(kept.triangles.size(), 4U);
  EXPECT_EQ(kept.vertices.size(), 4U);
  EXPECT_NEAR(volume(kept), 1.0 / 6.0, 1e-12);
  EXPECT_EQ(without_small_pieces(mesh, 0).triangles.size(), 5U);
}

}  // namespace
}  // namespace asbuilt::fuse
