// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/field_of_view.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <vector>

namespace asbuilt::scan {
namespace {

constexpr double kStep = 0.0025;      // between rays
constexpr double kHalfWidth = 0.4;    // of the camera's field, at distance 1
constexpr double kHalfHeight = 0.25;  // likewise
constexpr double kRange = 500.0;

// A camera away from the origin, pitched and rolled: nothing of its field lies along an axis.
const Eigen::Isometry3d scan_from_camera = Eigen::Translation3d(30, -40, 900) *
                                           Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, 0.4, 0).normalized()) *
                                           Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ());
const Viewpoint camera{Viewpoint::Kind::point, scan_from_camera.translation()};

Eigen::Vector3d at(double x, double y, double range) {
  return scan_from_camera * Eigen::Vector3d(x * range, y * range, range);
}

// What the camera measures of a wavy wall, where `is_there` (x and y at distance 1) says that there is one.
template <class IsThere>
std::vector<Eigen::Vector3f> seen(IsThere&& is_there) {
  std::vector<Eigen::Vector3f> points;
  for (double x = -kHalfWidth; x <= kHalfWidth; x += kStep) {
    for (double y = -kHalfHeight; y <= kHalfHeight; y += kStep) {
      if (is_there(x, y)) points.emplace_back(at(x, y, kRange + 60.0 * std::sin(9.0 * x + 5.0 * y)).cast<float>());
    }
  }
  return points;
}

TEST(FieldOfView, OfACameraThatSawSomethingEverywhereHasFourSides) {
  const FieldOfView field(seen([](double, double) { return true; }), kStep * kRange, camera);
  ASSERT_EQ(field.sides(), 4);
  for (const double x : {-0.39, 0.0, 0.39}) {
    for (const double y : {-0.24, 0.0, 0.24}) {
      for (const double range : {50.0, 500.0, 5000.0}) EXPECT_FALSE(field.is_outside(at(x, y, range))) << x << ' ' << y;
    }
  }
  for (const double range : {50.0, 500.0, 5000.0}) {
    EXPECT_TRUE(field.is_outside(at(0.45, 0.1, range)));
    EXPECT_TRUE(field.is_outside(at(-0.45, 0.1, range)));
    EXPECT_TRUE(field.is_outside(at(0.1, 0.30, range)));
    EXPECT_TRUE(field.is_outside(at(0.1, -0.30, range)));
  }
}

TEST(FieldOfView, HasNoSideWhereTheCameraLookedIntoTheVoid) {
  // A floor in the lower part of the image: it ends at an uneven horizon, not at the camera's field.
  const FieldOfView field(seen([](double x, double y) { return y > 0.12 * std::cos(10.0 * x) - 0.05; }), kStep * kRange,
                          camera);
  EXPECT_EQ(field.sides(), 3);
  EXPECT_FALSE(field.is_outside(at(0.1, -0.24, kRange)));
  EXPECT_FALSE(field.is_outside(at(0.1, -0.50, kRange)));
  EXPECT_TRUE(field.is_outside(at(0.1, 0.30, kRange)));
  EXPECT_TRUE(field.is_outside(at(-0.45, 0.1, kRange)));
}

TEST(FieldOfView, IsNotTheOutlineOfARoundThing) {
  const FieldOfView round(seen([](double x, double y) { return std::hypot(x, y) < 0.2; }), kStep * kRange, camera);
  EXPECT_EQ(round.sides(), 0);
  EXPECT_FALSE(round.is_outside(at(0.3, 0.0, kRange)));
}

TEST(FieldOfView, OfAScannerThatTurnsHasNoSides) {
  std::vector<Eigen::Vector3f> points;
  for (double azimuth = 0.0; azimuth < 2.0 * std::numbers::pi; azimuth += 0.02) {
    for (double elevation = -0.5; elevation < 0.5; elevation += 0.02) {
      const double flat = std::cos(elevation);
      points.emplace_back(
          (1000.0 * Eigen::Vector3d(flat * std::cos(azimuth), flat * std::sin(azimuth), std::sin(elevation)))
              .cast<float>());
    }
  }
  const FieldOfView field(points, 20.0, {Viewpoint::Kind::point, Eigen::Vector3d::Zero()});
  EXPECT_EQ(field.sides(), 0);
}

TEST(FieldOfView, OfParallelRaysIsARectangleToo) {
  std::vector<Eigen::Vector3f> points;
  for (double x = -40.0; x <= 40.0; x += 1.0) {
    for (double y = -20.0; y <= 20.0; y += 1.0)
      points.emplace_back(Eigen::Vector3d(x, y, 9.0 * std::sin(x)).cast<float>());
  }
  const FieldOfView field(points, 1.0, {Viewpoint::Kind::direction, Eigen::Vector3d::UnitZ()});
  EXPECT_EQ(field.sides(), 4);
  EXPECT_FALSE(field.is_outside({39.0, -19.0, 70.0}));
  EXPECT_TRUE(field.is_outside({44.0, 0.0, 70.0}));
  EXPECT_TRUE(field.is_outside({0.0, -24.0, -70.0}));
}

TEST(FieldOfView, OfFewPointsIsUnknown) {
  const std::vector<Eigen::Vector3f> few{{0, 0, 100}, {10, 0, 100}, {10, 10, 100}, {0, 10, 100}};
  const FieldOfView field(few, 10.0, {Viewpoint::Kind::point, Eigen::Vector3d::Zero()});
  EXPECT_EQ(field.sides(), 0);
  const FieldOfView none({}, 1.0, {Viewpoint::Kind::point, Eigen::Vector3d::Zero()});
  EXPECT_FALSE(none.is_outside({1, 2, 3}));
}

}  // namespace
}  // namespace asbuilt::scan
