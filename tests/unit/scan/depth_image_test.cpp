// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/depth_image.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

using Evidence = DepthImage::Evidence;

// A wall of 80 x 80 at z = 100, seen from the origin or by rays along +z.
class WallSeen : public testing::TestWithParam<Viewpoint> {
 protected:
  WallSeen() : image(test::plane_cloud(80.0, 1.0, 100.0, 0.0, 1).positions, 1.0, GetParam()) {}
  DepthImage image;
};

TEST_P(WallSeen, IsNearOnItselfAndWithinTheTolerance) {
  EXPECT_EQ(image.evidence({3, 4, 100}, 1.0), Evidence::near);
  EXPECT_EQ(image.evidence({3, 4, 101.5}, 2.0), Evidence::near);
  EXPECT_EQ(image.evidence({3, 4, 98.5}, 2.0), Evidence::near);
}

TEST_P(WallSeen, HidesWhatIsBehind) {
  EXPECT_EQ(image.evidence({3, 4, 120}, 2.0), Evidence::hidden);
  EXPECT_TRUE(image.hides({3, 4, 120}, 2.0));
  EXPECT_FALSE(image.hides({3, 4, 100}, 2.0));
  EXPECT_FALSE(image.hides({3, 4, 120}, 25.0));
}

TEST_P(WallSeen, ProvesThatWhatIsBeforeItIsFree) {
  EXPECT_EQ(image.evidence({3, 4, 80}, 2.0), Evidence::free);
  EXPECT_FALSE(image.hides({3, 4, 80}, 2.0));
}

TEST_P(WallSeen, SaysNothingOfWhereNothingWasMeasured) {
  EXPECT_EQ(image.evidence({400, 4, 100}, 2.0), Evidence::unknown);
  EXPECT_FALSE(image.hides({400, 4, 120}, 2.0));
}

INSTANTIATE_TEST_SUITE_P(DepthImage, WallSeen,
                         testing::Values(Viewpoint{Viewpoint::Kind::point, Eigen::Vector3d::Zero()},
                                         Viewpoint{Viewpoint::Kind::direction, Eigen::Vector3d::UnitZ()}),
                         [](const auto& viewpoint) {
                           return viewpoint.param.kind == Viewpoint::Kind::point ? "FromAPoint" : "ByParallelRays";
                         });

TEST(DepthImage, LooksIntoAllSixDirections) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      std::vector<Eigen::Vector3f> wall;
      for (const Eigen::Vector3f& p : test::plane_cloud(60.0, 1.0, 100.0 * sign, 0.0, 1).positions) {
        Eigen::Vector3f turned;
        turned[axis] = p.z();
        turned[(axis + 1) % 3] = p.x();
        turned[(axis + 2) % 3] = p.y();
        wall.push_back(turned + Eigen::Vector3f(500, 600, 700));
      }
      const Eigen::Vector3d eye(500, 600, 700);
      const DepthImage image(wall, 1.0, {Viewpoint::Kind::point, eye});
      const Eigen::Vector3d out = sign * Eigen::Vector3d::Unit(axis);
      EXPECT_EQ(image.evidence(eye + 100.0 * out, 1.0), Evidence::near) << axis << ' ' << sign;
      EXPECT_EQ(image.evidence(eye + 150.0 * out, 1.0), Evidence::hidden) << axis << ' ' << sign;
      EXPECT_EQ(image.evidence(eye + 50.0 * out, 1.0), Evidence::free) << axis << ' ' << sign;
      EXPECT_EQ(image.evidence(eye - 50.0 * out, 1.0), Evidence::unknown) << axis << ' ' << sign;
    }
  }
}

// By parallel rays along +z: a surface at 60 where x is negative, one at 100 elsewhere.
DepthImage of_two_surfaces() {
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3f& p : test::plane_cloud(80.0, 1.0, 100.0, 0.0, 1).positions) {
    points.emplace_back(p.x(), p.y(), p.x() < 0.0F ? 60.0F : 100.0F);
  }
  return {points, 1.0, {Viewpoint::Kind::direction, Eigen::Vector3d::UnitZ()}};
}

// Where a front and a back surface both lie around the ray, either may have returned it.
TEST(DepthImage, IsUndecidedAtTheEdgeOfASurface) {
  const DepthImage image = of_two_surfaces();
  EXPECT_EQ(image.evidence({-10, 0, 80}, 2.0), Evidence::hidden);
  EXPECT_EQ(image.evidence({10, 0, 80}, 2.0), Evidence::free);
  EXPECT_EQ(image.evidence({0, 0, 80}, 2.0), Evidence::unknown);
}

// What is measured past the edge of a surface in front says nothing about what lies behind that surface.
TEST(DepthImage, BehindTheEdgeOfSomethingInFrontAllIsHidden) {
  const DepthImage image = of_two_surfaces();
  EXPECT_EQ(image.evidence({-1.5, 0, 100}, 2.0), Evidence::hidden);
  EXPECT_EQ(image.evidence({1.5, 0, 100}, 2.0), Evidence::near);
}

TEST(DepthImage, BelievesNoSingleStrayReturn) {
  const std::vector<Eigen::Vector3f> stray{{0, 0, 50}};
  const DepthImage image(stray, 1.0, {Viewpoint::Kind::direction, Eigen::Vector3d::UnitZ()});
  EXPECT_EQ(image.evidence({0, 0, 80}, 2.0), Evidence::unknown);
  EXPECT_EQ(image.evidence({0, 0, 20}, 2.0), Evidence::unknown);
}

TEST(DepthImage, OfNothingKnowsNothing) {
  const DepthImage image({}, 1.0, {Viewpoint::Kind::point, Eigen::Vector3d::Zero()});
  EXPECT_EQ(image.evidence({0, 0, 80}, 2.0), Evidence::unknown);
}

TEST(DepthImage, NeedsAViewpoint) {
  const std::vector<Eigen::Vector3f> points{{0, 0, 50}};
  EXPECT_THROW(DepthImage(points, 1.0, Viewpoint{}), std::logic_error);
}

}  // namespace
}  // namespace asbuilt::scan
