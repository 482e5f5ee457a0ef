// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/mesh_edit.h"

#include <gtest/gtest.h>

#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

TEST(MeshEdit, SubdivisionShortensEdgesAndKeepsTheSurface) {
  const TriangleMesh coarse = test::stepped_block();
  const TriangleMesh fine = subdivided(coarse, [](const Eigen::Vector3d& p) { return p.x() > 40.0 ? 6.0 : 20.0; });
  EXPECT_TRUE(test::is_closed_manifold(fine));
  EXPECT_NEAR(surface_area(fine), surface_area(coarse), 1e-8 * surface_area(coarse));
  EXPECT_NEAR(test::volume(fine), test::volume(coarse), 1e-8 * test::volume(coarse));
  for (const Eigen::Vector3i& t : fine.triangles) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a = fine.vertices[static_cast<std::size_t>(t[k])];
      const Eigen::Vector3d b = fine.vertices[static_cast<std::size_t>(t[(k + 1) % 3])];
      EXPECT_LE((a - b).norm(), 0.5 * (a + b).x() > 40.0 ? 6.0 : 20.0);
    }
  }
}

TEST(MeshEdit, WeldingJoinsEqualVerticesAndDropsCollapsedTriangles) {
  TriangleMesh soup;
  for (const Eigen::Vector3i& t : test::stepped_block().triangles) {
    const int first = static_cast<int>(soup.vertices.size());
    for (int k = 0; k < 3; ++k) {
      soup.vertices.push_back(test::stepped_block().vertices[static_cast<std::size_t>(t[k])]);
    }
    soup.triangles.emplace_back(first, first + 1, first + 2);
  }
  soup.triangles.emplace_back(0, 0, 1);
  const TriangleMesh mesh = welded(soup);
  EXPECT_EQ(mesh.vertices.size(), 16U);
  EXPECT_EQ(mesh.triangles.size(), 28U);
  EXPECT_TRUE(test::is_closed_manifold(mesh));
}

TEST(MeshEdit, MirroringKeepsTheOutsideOutside) {
  const TriangleMesh mirrored = scaled(test::stepped_block(), {-1.0, 1.0, 1.0});
  EXPECT_NEAR(test::volume(mirrored), test::volume(test::stepped_block()), 1e-9 * test::volume(mirrored));
}

TEST(MeshEdit, SamplesCoverFacesByTheirArea) {
  const TriangleMesh mesh = box({10, 20, 40});
  const auto samples = area_samples(mesh, 2800, Random(1, "samples", 0));
  // Faces across x: 2 * 20 * 40 of 2800 mm^2 in all; strata make this exact but for the borders of triangles.
  const auto across_x =
      std::ranges::count_if(samples, [](const SurfacePoint& s) { return std::abs(s.normal.x()) > 0.5; });
  EXPECT_NEAR(static_cast<double>(across_x), 1600.0, 5.0);
  for (const SurfacePoint& s : samples) {
    EXPECT_NEAR((s.position.cwiseAbs() - Eigen::Vector3d(5, 10, 20)).maxCoeff(), 0.0, 1e-9);
    EXPECT_GT(s.normal.dot(s.position), 0.0);
  }
}

}  // namespace
}  // namespace asbuilt::simulate
