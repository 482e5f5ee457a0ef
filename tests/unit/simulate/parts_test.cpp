// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/parts.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "asbuilt/model/surface_distance.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

using test::is_closed_manifold;
using test::volume;

TEST(Parts, AllAreClosedAndWoundOutwards) {
  for (const TriangleMesh& mesh :
       {box({1, 2, 3}), cylinder(50, 100), sphere(50), l_profile(40, 30, 5, 100), i_beam(40, 50, 5, 100),
        gear(50, 10, 20), stepped_block(), flange(100, 16, 6, 5), pipe_elbow(100, 30, 5), valve_body(5.0)}) {
    EXPECT_TRUE(is_closed_manifold(mesh)) << mesh.triangles.size() << " triangles";
    EXPECT_GT(volume(mesh), 0.0) << mesh.triangles.size() << " triangles";
  }
}

TEST(Parts, VolumesOfPrismsAreThoseOfTheirOutlines) {
  EXPECT_NEAR(volume(box({10, 20, 30})), 6000.0, 1e-9);
  EXPECT_NEAR(volume(l_profile(40, 30, 5, 100)), (40 * 5 + 25 * 5) * 100.0, 1e-9);
  EXPECT_NEAR(volume(i_beam(40, 50, 4, 100)), (2 * 40 * 4 + 42 * 4) * 100.0, 1e-9);
  // A regular polygon of n corners on a circle has the area n/2 r^2 sin(2 pi / n).
  EXPECT_NEAR(volume(cylinder(50, 100, 48)), 24.0 * 2500.0 * std::sin(2.0 * std::numbers::pi / 48.0) * 100.0, 1e-6);
}

TEST(Parts, ElbowHasTheVolumeThatPappusGivesIt) {
  const double area = std::numbers::pi * (30.0 * 30.0 - 25.0 * 25.0), way = 100.0 * std::numbers::pi / 2.0;
  EXPECT_NEAR(volume(pipe_elbow(100, 30, 5, 90.0, 96)), area * way, 0.005 * area * way);
}

TEST(Parts, SphereHasItsVerticesOnTheSphere) {
  const TriangleMesh mesh = sphere(50.0, 3);
  EXPECT_EQ(mesh.triangles.size(), 8U * 64U);
  for (const Eigen::Vector3d& vertex : mesh.vertices) EXPECT_NEAR(vertex.norm(), 50.0, 1e-12);
}

TEST(Parts, ValveBodyIsAsLargeAsPromised) {
  const TriangleMesh mesh = valve_body();
  const Eigen::Vector3d size = bounding_box(mesh).sizes();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_GT(size[axis], 200.0);
    EXPECT_LT(size[axis], 400.0);
  }
  EXPECT_TRUE(is_closed_manifold(mesh));
  // A casting is mostly wall and air: well below half of its box.
  EXPECT_LT(volume(mesh), 0.3 * size.prod());
}

TEST(Parts, ValveBodyIsNotItsOwnImageUnderAnyMotionOrMirror) {
  // A symmetry keeps the principal axes up to sign when the moments differ, so only eight candidates remain.
  const TriangleMesh mesh = valve_body(6.0);
  const auto samples = area_samples(mesh, 2000, Random(1, "moments", 0));
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const SurfacePoint& s : samples) centre += s.position / 2000.0;
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const SurfacePoint& s : samples) second += (s.position - centre) * (s.position - centre).transpose() / 2000.0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(second);
  const Eigen::Vector3d spread = axes.eigenvalues().cwiseSqrt();
  EXPECT_GT(spread[1] / spread[0], 1.05);
  EXPECT_GT(spread[2] / spread[1], 1.05);
  const model::SurfaceDistance surface(mesh);
  for (int signs = 1; signs < 8; ++signs) {
    const Eigen::Vector3d flip(signs & 1 ? -1 : 1, signs & 2 ? -1 : 1, signs & 4 ? -1 : 1);
    const Eigen::Matrix3d turn = axes.eigenvectors() * flip.asDiagonal() * axes.eigenvectors().transpose();
    double mean = 0.0;
    for (const SurfacePoint& s : samples) {
      mean += std::abs(surface.nearest(centre + turn * (s.position - centre)).signed_distance) / 2000.0;
    }
    EXPECT_GT(mean, 0.01 * diameter(mesh)) << "signs " << flip.transpose();
  }
}

TEST(Parts, RandomShapesHaveTheSizeAskedFor) {
  for (std::uint64_t i = 0; i < 40; ++i) {
    Random random(3, "shape", i);
    const TriangleMesh shape = random_shape(random, 123.0);
    EXPECT_NEAR(diameter(shape), 123.0, 1e-9);
    EXPECT_LT(bounding_box(shape).center().norm(), 1e-9);
    EXPECT_TRUE(is_closed_manifold(shape));
  }
}

}  // namespace
}  // namespace asbuilt::simulate
