// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/face_support.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "asbuilt/core/random.h"
#include "asbuilt/scan/face_normals.h"

namespace asbuilt::scan {
namespace {

constexpr double kSigma = 0.05;  // mm; samples are 1 mm apart

PointCloud noisy_plate(int side) {
  PointCloud cloud;
  Random random(11, "plate", 0);
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      cloud.positions.push_back(Eigen::Vector3d(i, j, kSigma * random.normal()).cast<float>());
      cloud.normals.push_back(Eigen::Vector3f::UnitZ());
    }
  }
  return cloud;
}

std::vector<std::uint8_t> support_of_all(const PointCloud& cloud, bool curved) {
  const KdTree tree(cloud.positions);
  std::vector<std::uint32_t> all(cloud.size());
  std::iota(all.begin(), all.end(), 0U);
  const Context context(2);
  const auto faces = face_normals(cloud, tree, kSigma, 1.0, context);
  return face_support(all, cloud, faces, tree, {.noise_sigma_mm = kSigma, .curved = curved}, context);
}

// At a corner of the plate a face is fitted to one side only, and one point in 370 is more than 3 sigma off.
TEST(FaceSupport, OfAPlateIsNearlyFullEvenAtItsRim) {
  std::size_t few = 0;
  const std::vector<std::uint8_t> support = support_of_all(noisy_plate(20), false);
  for (const std::uint8_t count : support) few += count < 8 ? 1 : 0;
  EXPECT_LE(few, support.size() / 50);
  EXPECT_GE(std::ranges::min(support), 3);
}

TEST(FaceSupport, OfAPointThatFloatsAboveAPlateIsNone) {
  PointCloud cloud = noisy_plate(20);
  cloud.positions.emplace_back(10.5F, 10.5F, 20.0F * static_cast<float>(kSigma));
  cloud.normals.push_back(Eigen::Vector3f::UnitZ());
  EXPECT_LE(support_of_all(cloud, true).back(), 1);
}

// Along a circle of radius r a neighbour at the chord c lies c^2 / 2r below the tangent, but exactly at right angles to
// the mean of both normals.
TEST(FaceSupport, AsksTheMeanOfTwoNormalsOnACurvedSurface) {
  constexpr double kRadius = 5.0;
  PointCloud cloud;
  for (int i = 0; i < 31; ++i) {
    for (int j = 0; j < 15; ++j) {
      const double angle = 2.0 * 3.14159265358979 * i / 31.0;
      const Eigen::Vector3d normal(std::cos(angle), std::sin(angle), 0.0);
      cloud.positions.push_back((kRadius * normal + Eigen::Vector3d(0, 0, j)).cast<float>());
      cloud.normals.push_back(normal.cast<float>());
    }
  }
  const KdTree tree(cloud.positions);
  std::vector<std::uint32_t> all(cloud.size());
  std::iota(all.begin(), all.end(), 0U);
  InFace rule{.noise_sigma_mm = 0.01, .curved = false};
  const auto tangents = face_support(all, cloud, cloud.normals, tree, rule, Context(1));
  rule.curved = true;
  const auto means = face_support(all, cloud, cloud.normals, tree, rule, Context(1));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_LE(tangents[i], 6);
    EXPECT_GE(means[i], 11);
  }
}

}  // namespace
}  // namespace asbuilt::scan
