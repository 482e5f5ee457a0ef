// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/as_built.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/surface_distance.h"
#include "support/matchers.h"
#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

AsBuiltOptions exact() {
  AsBuiltOptions options;
  options.warp_ratio = 0.0;
  options.dents = 0;
  return options;
}

TEST(AsBuilt, WithoutDeviationItIsTheCad) {
  const AsBuilt result = as_built(test::stepped_block(), exact(), 1).value();
  EXPECT_EQ(result.mesh.vertices, test::stepped_block().vertices);
  EXPECT_EQ(result.mesh.triangles, test::stepped_block().triangles);
  EXPECT_EQ(result.deviation_max_mm, 0.0);
}

TEST(AsBuilt, WarpIsAsLargeAsAskedForAndHasNoRigidPart) {
  AsBuiltOptions options = exact();
  options.warp_ratio = 0.004;
  const TriangleMesh cad = sphere(100.0, 6);  // facets are fine already, so vertices keep their indices
  const AsBuilt result = as_built(cad, options, 5).value();
  ASSERT_EQ(result.mesh.vertices.size(), cad.vertices.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < cad.vertices.size(); ++i) {
    largest = std::max(largest, (result.mesh.vertices[i] - cad.vertices[i]).norm());
  }
  EXPECT_NEAR(largest, 0.004 * diameter(cad), 0.01 * largest);
  EXPECT_NEAR(result.deviation_max_mm, largest, 1e-9);
  EXPECT_GT(result.deviation_rms_mm, 0.2 * largest);
  EXPECT_THAT(best_rigid_motion(result.mesh.vertices, cad.vertices),
              test::PoseNear(Pose::Identity(), 0.01 * largest, 0.01));
}

TEST(AsBuilt, DentIsAsDeepAsAskedForAndNowhereElse) {
  const TriangleMesh cad = box({200, 200, 40});
  const Bump dent{{30, 20, 20}, {0, 0, 1}, 25.0, -3.0};
  const TriangleMesh dented = with_bumps(cad, std::span(&dent, 1));
  EXPECT_TRUE(test::is_closed_manifold(dented));
  double lowest = 20.0;
  for (const Eigen::Vector3d& v : dented.vertices) {
    if (v.z() <= 0.0) continue;
    if ((v - dent.centre_in_model).head<2>().norm() < 25.0)
      lowest = std::min(lowest, v.z());
    else
      EXPECT_EQ(v.z(), v.z() > 19.99 ? 20.0 : v.z());
  }
  EXPECT_NEAR(lowest, 17.0, 0.15);  // a vertex lies within a fine edge of the centre
  const model::SurfaceDistance surface(dented);
  EXPECT_NEAR(surface.nearest({30, 20, -20}).signed_distance, 0.0, 1e-9);  // the other side is untouched
}

TEST(AsBuilt, ScaleMakesThePartLargerAboutItsCentre) {
  AsBuiltOptions options = exact();
  options.scale = 1.01;
  const TriangleMesh cad = test::stepped_block();
  const AsBuilt result = as_built(cad, options, 1).value();
  EXPECT_NEAR(diameter(result.mesh), 1.01 * diameter(cad), 1e-9);
  EXPECT_NEAR(test::volume(result.mesh), std::pow(1.01, 3) * test::volume(cad), 1e-3);
}

TEST(AsBuilt, SoupsDoNotCrackOpen) {
  TriangleMesh soup;
  for (const Eigen::Vector3i& t : test::stepped_block().triangles) {
    const int first = static_cast<int>(soup.vertices.size());
    for (int k = 0; k < 3; ++k) {
      soup.vertices.push_back(test::stepped_block().vertices[static_cast<std::size_t>(t[k])]);
    }
    soup.triangles.emplace_back(first, first + 1, first + 2);
  }
  AsBuiltOptions options;
  options.dents = 3;
  options.bosses = 2;
  EXPECT_TRUE(test::is_closed_manifold(as_built(soup, options, 2).value().mesh));
}

TEST(AsBuilt, ImpossibleOptionsAndMeshesAreErrors) {
  AsBuiltOptions options;
  options.warp_ratio = -0.1;
  EXPECT_THAT(as_built(test::stepped_block(), options, 1), test::FailsWith(ErrorCode::invalid_argument));
  options = {};
  options.scale = std::nan("");
  EXPECT_THAT(as_built(test::stepped_block(), options, 1), test::FailsWith(ErrorCode::invalid_argument));
  EXPECT_THAT(as_built({}, {}, 1), test::FailsWith(ErrorCode::not_possible));
}

}  // namespace
}  // namespace asbuilt::simulate
