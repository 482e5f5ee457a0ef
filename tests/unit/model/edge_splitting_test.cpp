// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/edge_splitting.h"

#include <gtest/gtest.h>

#include "asbuilt/model/mesh_edges.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

double longest_edge(const TriangleMesh& mesh, const Eigen::Vector3i& t) {
  const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k % 3])]; };
  return std::max({(at(1) - at(0)).norm(), (at(2) - at(1)).norm(), (at(3) - at(2)).norm()});
}

TEST(EdgeSplitting, KeepsAClosedBodyClosedAndItsVolumeWhateverIsChosen) {
  const TriangleMesh box = test::joined(test::box({0, 0, 0}, {10, 7, 3}, 2));
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed, "chosen faces", 0);
    TriangleMesh mesh = box;
    for (int round = 0; round < 3; ++round) {
      std::vector<std::uint8_t> chosen(mesh.triangles.size());
      for (std::uint8_t& one : chosen) one = random.uniform() < 0.2 ? 1 : 0;
      mesh = split_long_edges(mesh, chosen, random.uniform(0.5, 6.0)).mesh;
      EXPECT_EQ(count_open_edges(mesh), 0U) << "seed " << seed;
      EXPECT_NEAR(test::sixfold_volume(mesh), 6.0 * 10 * 7 * 3, 1e-9) << "seed " << seed;
      EXPECT_NEAR(surface_area(mesh), 2.0 * (70 + 21 + 30), 1e-9) << "seed " << seed;
    }
  }
}

TEST(EdgeSplitting, HalvesWhatIsChosenAndLongAndNothingElse) {
  const TriangleMesh box = test::joined(test::box({0, 0, 0}, {8, 8, 8}));
  std::vector<std::uint8_t> chosen(box.triangles.size(), 0);
  EXPECT_EQ(split_long_edges(box, chosen, 1.0).mesh.triangles.size(), box.triangles.size());
  chosen[3] = 1;
  EXPECT_EQ(split_long_edges(box, chosen, 20.0).mesh.triangles.size(), box.triangles.size());
  const SplitMesh split = split_long_edges(box, chosen, 1.0);
  EXPECT_EQ(split.mesh.triangles.size(), box.triangles.size() + 3 + 3);  // four for one; its three neighbours in two
  for (std::size_t i = 0; i < split.parents.size(); ++i) {
    if (split.parents[i] != 3) continue;
    EXPECT_LE(longest_edge(split.mesh, split.mesh.triangles[i]), 0.5 * longest_edge(box, box.triangles[3]) + 1e-12);
  }
}

TEST(EdgeSplitting, PiecesKnowTheirParentAndItsCadFace) {
  TriangleMesh box = test::joined(test::box({0, 0, 0}, {4, 5, 6}));
  for (std::size_t i = 0; i < box.triangles.size(); ++i) box.cad_faces.push_back(static_cast<int>(i) + 100);
  const SplitMesh split = split_long_edges(box, std::vector<std::uint8_t>(box.triangles.size(), 1), 3.0);
  ASSERT_EQ(split.mesh.cad_faces.size(), split.mesh.triangles.size());
  ASSERT_EQ(split.parents.size(), split.mesh.triangles.size());
  for (std::size_t i = 0; i < split.parents.size(); ++i) {
    EXPECT_EQ(split.mesh.cad_faces[i], static_cast<int>(split.parents[i]) + 100);
    const Eigen::Vector3d piece = doubled_area_vector(split.mesh, i).normalized();
    EXPECT_NEAR((piece - doubled_area_vector(box, split.parents[i]).normalized()).norm(), 0.0, 1e-12);
  }
}

}  // namespace
}  // namespace asbuilt::model
