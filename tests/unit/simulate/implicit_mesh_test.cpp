// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/implicit_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

const Eigen::AlignedBox3d kBox(Eigen::Vector3d(-30, -30, -30), Eigen::Vector3d(30, 30, 30));

TEST(ImplicitMesh, SphereHasTheRightVolumeAndDistance) {
  const TriangleMesh mesh = surface_of([](const Eigen::Vector3d& p) { return p.norm() - 25.0; }, kBox, 2.0);
  EXPECT_TRUE(test::is_closed_manifold(mesh));
  EXPECT_NEAR(test::volume(mesh), 4.0 / 3.0 * std::numbers::pi * std::pow(25.0, 3), 0.01 * 65450.0);
  for (const Eigen::Vector3d& v : mesh.vertices) EXPECT_NEAR(v.norm(), 25.0, 0.1);  // sagitta of a 2 mm cell: 0.04
}

TEST(ImplicitMesh, SharpEdgesOfATurnedBlockStaySharp) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const auto block = [&](const Eigen::Vector3d& p) {
    return ((turn * p).cwiseAbs() - Eigen::Vector3d(20, 15, 10)).maxCoeff();
  };
  const TriangleMesh mesh = surface_of(block, kBox, 2.0);
  EXPECT_TRUE(test::is_closed_manifold(mesh));
  // Marching cubes would lose about half a cell along each of the edges, some 2 %.
  EXPECT_NEAR(test::volume(mesh), 24000.0, 0.002 * 24000.0);
}

TEST(ImplicitMesh, TorusHasAHole) {
  const TriangleMesh mesh = surface_of(
      [](const Eigen::Vector3d& p) { return std::hypot(std::hypot(p.x(), p.y()) - 18.0, p.z()) - 6.0; }, kBox, 2.0);
  ASSERT_TRUE(test::is_closed_manifold(mesh));
  // Euler: V - E + F = 2 - 2 genus, E = 3 F / 2.
  EXPECT_EQ(2 * static_cast<long>(mesh.vertices.size()) - static_cast<long>(mesh.triangles.size()), 0);
}

}  // namespace
}  // namespace asbuilt::simulate
