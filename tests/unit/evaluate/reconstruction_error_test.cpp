// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/reconstruction_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

#include "asbuilt/simulate/mesh_edit.h"
#include "support/parts.h"
#include "unit/evaluate/surface_points.h"

namespace asbuilt::evaluate {
namespace {

using Points = std::vector<Eigen::Vector3d>;

template <class Predicate>
Points where(const Points& points, const Predicate& holds) {
  Points chosen;
  std::ranges::copy_if(points, std::back_inserter(chosen), holds);
  return chosen;
}

TEST(ReconstructionError, CountsFinitePointsFurtherThanTheDistanceOnBothSides) {
  const model::SurfaceDistance surface(simulate::box({20, 20, 20}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Points points{{0, 0, 12}, {0, 0, 13.5}, {0, 0, 9}, {0, 0, 6}, {13, 14, 10}, {nan, 0, 0}};
  const PointsBeyond found = points_beyond(points, 3.0, surface, Context(2));
  EXPECT_EQ(found.points, 5U);
  EXPECT_EQ(found.beyond, 3U);  // 3.5 outside, 4 inside, 5 from an edge
  EXPECT_DOUBLE_EQ(found.share(), 0.6);
  EXPECT_EQ(points_beyond({}, 3.0, surface, Context(1)).share(), 0.0);
}

TEST(ReconstructionError, CompletenessIsTheShareOfTheAreaThatIsThere) {
  const TriangleMesh mesh = simulate::box({60, 40, 20});
  const model::SurfaceDistance surface(mesh);
  const Points all = test::surface_points(mesh, 40000);
  EXPECT_EQ(completeness(all, all, 1.5, mesh, surface, Context(2)), 1.0);
  EXPECT_EQ(completeness({}, all, 1.5, mesh, surface, Context(2)), 0.0);
  EXPECT_EQ(completeness(all, {}, 1.5, mesh, surface, Context(2)), 1.0);
  // Without the top: 60 x 40 of 2 (60 x 40 + 60 x 20 + 40 x 20).
  const Points no_top = where(all, [](const Eigen::Vector3d& p) { return p.z() < 9.999; });
  EXPECT_NEAR(completeness(no_top, all, 1.5, mesh, surface, Context(2)), 1.0 - 2400.0 / 8800.0, 0.01);
  // What the reference does not cover is asked of nobody.
  EXPECT_EQ(completeness(no_top, no_top, 1.5, mesh, surface, Context(2)), 1.0);
}

TEST(ReconstructionError, CompletenessAsksEachSideOfASheetForItself) {
  const TriangleMesh mesh = simulate::box({60, 60, 0.5});
  const model::SurfaceDistance surface(mesh);
  const Points all = test::surface_points(mesh, 40000);
  const Points top = where(all, [](const Eigen::Vector3d& p) { return p.z() > 0.249; });
  EXPECT_NEAR(completeness(top, all, 1.5, mesh, surface, Context(2)), 0.5, 0.02);
}

TEST(ReconstructionError, PointsOffTheSurfaceCoverTheirFeet) {
  const TriangleMesh mesh = simulate::box({60, 40, 20});
  const model::SurfaceDistance surface(mesh);
  const Points all = test::surface_points(mesh, 40000);
  Points raised = all;
  for (Eigen::Vector3d& point : raised) point *= 1.02;
  EXPECT_GT(completeness(raised, all, 1.5, mesh, surface, Context(2)), 0.995);
}

}  // namespace
}  // namespace asbuilt::evaluate
