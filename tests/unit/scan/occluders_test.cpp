// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/occluders.h"

#include <gtest/gtest.h>

#include <cmath>

namespace asbuilt::scan {
namespace {

// From the origin, rays in even steps along +z: a plate of 200 x 200 mm at z = 1000, before it a bar of 20 mm along y
// at z = 700, far behind both a wall. The bar hides what of the plate lies between x = -14.3 and 14.3.
struct Plate {
  Scan scan;
  PointCloud plate;
};

constexpr double kHalf = 100.0, kDepth = 1000.0, kBarHalf = 10.0, kBarDepth = 700.0;

Plate plate_behind_a_bar(const Viewpoint& viewpoint) {
  Plate result;
  constexpr double kPlateStep = 0.002;  // 2 mm on the plate
  for (double u = -0.2; u < 0.2; u += kPlateStep) {
    for (double v = -0.2; v < 0.2; v += kPlateStep) {
      const bool on_bar = std::abs(u * kBarDepth) < kBarHalf;
      const bool on_plate = !on_bar && std::abs(u * kDepth) < kHalf && std::abs(v * kDepth) < kHalf;
      const double depth = on_bar ? kBarDepth : on_plate ? kDepth : 2000.0;
      const Eigen::Vector3f point = (depth * Eigen::Vector3d(u, v, 1.0)).cast<float>();
      result.scan.cloud.positions.push_back(point);
      result.scan.cloud.normals.push_back(-Eigen::Vector3f::UnitZ());
      if (!on_plate) continue;
      result.plate.positions.push_back(point);
      result.plate.normals.push_back(-Eigen::Vector3f::UnitZ());
    }
  }
  result.scan.viewpoint = viewpoint;
  result.scan.spacing_mm = 2.0;
  result.scan.noise_sigma_mm = 0.1;
  return result;
}

TEST(Occluders, AreSeenBesideWhatTheyHide) {
  const Plate seen = plate_behind_a_bar({Viewpoint::Kind::point, Eigen::Vector3d::Zero()});
  const std::vector<std::uint8_t> beside = Occluders(seen.scan).beside(seen.plate, Context(2));
  ASSERT_EQ(beside.size(), seen.plate.size());
  const double shadow = kBarHalf * kDepth / kBarDepth;
  std::size_t marked = 0;
  for (std::size_t i = 0; i < beside.size(); ++i) {
    const double from_shadow = std::abs(static_cast<double>(seen.plate.positions[i].x())) - shadow;
    if (from_shadow < 3.0) {
      EXPECT_EQ(beside[i], 1) << from_shadow;
    } else if (from_shadow > 14.0) {
      EXPECT_EQ(beside[i], 0) << "also at the plate's own rim, which ends before a wall";
    }
    marked += beside[i];
  }
  EXPECT_GT(marked, 0U);
}

TEST(Occluders, OfAScanWithoutAViewpointAreNotKnown) {
  const Plate seen = plate_behind_a_bar({});
  EXPECT_TRUE(Occluders(seen.scan).beside(seen.plate, Context(1)).empty());
}

}  // namespace
}  // namespace asbuilt::scan
