// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/next_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/simulate/parts.h"
#include "support/parts.h"

namespace asbuilt::live {
namespace {

model::PreparedModel prepared(const TriangleMesh& mesh) { return model::prepare(mesh, {}, Context(2)).value(); }

TEST(ViewPlanner, FromOutsideACubeShowsAtMostThreeFacesAndAllCanBeSeen) {
  const auto model = prepared(simulate::box(Eigen::Vector3d::Constant(100.0)));
  const Surface surface = surface_of(model);
  EXPECT_NEAR(surface.total_area_mm2, 6.0e4, 1e-6);
  const ViewPlanner planner(surface, model, assumed_limits(model.diameter), Context(2));
  EXPECT_NEAR(planner.coverable_share(), 1.0, 1e-9);
  for (std::size_t c = 0; c < planner.candidates().size(); ++c) {
    const Eigen::Vector3d from = planner.candidates()[c].position;
    for (std::size_t s = 0; s < planner.samples().size(); ++s) {
      // A convex part hides nothing but what faces away: the truth is the sign of one product, and the angle.
      const auto v = planner.samples()[s];
      const Eigen::Vector3d normal = surface.mesh.normals[v].cast<double>();
      const Eigen::Vector3d ray = from - surface.mesh.vertices[v];
      const double off_axis = planner.candidates()[c].direction().dot(-ray.normalized());
      if (std::abs(off_axis - std::cos(25.0 * 3.14159265358979 / 180.0)) < 1e-3) continue;  // on the rim
      if (std::abs(ray.norm() - planner.limits().near_mm) < 0.1) continue;
      const bool in_field =
          off_axis > std::cos(25.0 * 3.14159265358979 / 180.0) && ray.norm() > planner.limits().near_mm;
      const double expected = in_field ? seen_weight(normal.dot(ray.normalized())) : 0.0;
      ASSERT_NEAR(static_cast<double>(planner.sees(c, s)), expected, 0.01);
    }
  }
}

TEST(ViewPlanner, AfterOneFaceOfACubeProposesWhatIsNotSeenYetWithOverlap) {
  const auto model = prepared(simulate::box(Eigen::Vector3d::Constant(100.0)));
  const Surface surface = surface_of(model);
  const ViewPlanner planner(surface, model, assumed_limits(model.diameter), Context(2));
  std::vector<char> seen(surface.mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < seen.size(); ++v) seen[v] = surface.mesh.normals[v].x() > 0.9F;
  const auto views = planner.best_views({seen});
  ASSERT_FALSE(views.empty());
  EXPECT_GT(views[0].view.position.x(), 0.0) << "the face that is known must be in view";
  EXPECT_GT(views[0].gain_share, 0.15);
  EXPECT_LE(views[0].gain_share, 2.0 / 6.0 + 1e-9);
  EXPECT_GE(views[0].overlap, 0.1);
}

TEST(ViewPlanner, TheMiddleOfALongBoreCannotBeSeen) {
  // The bore, 44 % of the surface, is 236 mm long and 16 mm wide. A ray that meets its wall at 67 degrees, where it is
  // seen well enough, comes in over at most 16 / tan(23 degrees) = 38 mm from either end: about a third of the bore.
  const auto elbow = simulate::pipe_elbow(150.0, 10.0, 2.0);
  model::ModelOptions options;
  options.keep_inner = true;
  const auto model = model::prepare(elbow, options, Context(2)).value();
  const Surface surface = surface_of(model);
  const ViewPlanner planner(surface, model, assumed_limits(model.diameter), Context(2));
  EXPECT_LT(planner.coverable_share(), 0.80);
  EXPECT_GT(planner.coverable_share(), 0.50);
}

TEST(Holes, ASquareLeftOutOfACubeIsOneHoleOfItsArea) {
  const auto model = prepared(simulate::box(Eigen::Vector3d::Constant(100.0)));
  const Surface surface = surface_of(model);
  std::vector<std::uint16_t> support(surface.mesh.vertices.size(), 1);
  for (std::size_t v = 0; v < support.size(); ++v) {
    if (surface.mesh.normals[v].z() > 0.9F) support[v] = 0;
  }
  const auto found = holes(surface, support, 0.002, 12);
  ASSERT_EQ(found.size(), 1U);
  // The rim is seen from the sides: the hole ends an edge or so before it.
  EXPECT_GT(found[0].area_mm2, 0.85e4);
  EXPECT_LE(found[0].area_mm2, 1.0e4 + 1e-6);
  EXPECT_NEAR(found[0].normal.z(), 1.0, 1e-6);
  EXPECT_NEAR(found[0].centre.z(), 50.0, 1e-6);
}

}  // namespace
}  // namespace asbuilt::live
