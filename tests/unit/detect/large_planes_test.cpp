// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/large_planes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "asbuilt/core/random.h"

namespace asbuilt::detect {
namespace {

// A rectangle of samples, spaced by 1 and shaken a little, around `centre` along two directions.
void add_rectangle(PointCloud& cloud, const Eigen::Vector3f& centre, const Eigen::Vector3f& along,
                   const Eigen::Vector3f& across, int length, int width, float height_noise = 0.0F) {
  Random random(3, "rectangle", cloud.size());
  const Eigen::Vector3f normal = along.cross(across).normalized();
  for (int i = 0; i <= length; ++i) {
    for (int j = 0; j <= width; ++j) {
      const auto shake = [&] { return static_cast<float>(random.uniform(-0.2, 0.2)); };
      const float u = static_cast<float>(i) - 0.5F * static_cast<float>(length) + shake();
      const float v = static_cast<float>(j) - 0.5F * static_cast<float>(width) + shake();
      const auto height = height_noise * static_cast<float>(random.normal());
      cloud.positions.push_back(centre + u * along + v * across + height * normal);
      cloud.normals.push_back(normal);
    }
  }
}

const Eigen::Vector3f kX = Eigen::Vector3f::UnitX(), kY = Eigen::Vector3f::UnitY(), kZ = Eigen::Vector3f::UnitZ();

std::vector<float> even(const PointCloud& cloud) { return std::vector<float>(cloud.size(), 1.0F); }

std::size_t marked(const std::vector<std::uint8_t>& marks, std::size_t begin, std::size_t end) {
  return static_cast<std::size_t>(std::count(marks.begin() + static_cast<std::ptrdiff_t>(begin),
                                             marks.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{1}));
}

TEST(LargePlanes, AreMarkedAndSmallOnesKept) {
  PointCloud cloud;
  add_rectangle(cloud, {0, 0, 0}, kX, kY, 60, 60);  // the floor
  const std::size_t floor = cloud.size();
  // A block on it: its sides begin at the floor, its top stands 12 above.
  add_rectangle(cloud, {0, 0, 12}, kX, kY, 20, 10);
  add_rectangle(cloud, {0, 5, 6.5F}, kX, kZ, 20, 11);
  add_rectangle(cloud, {10, 0, 6.5F}, kY, kZ, 10, 11);
  const auto marks = on_large_planes(cloud, even(cloud), 30.0, Context(2));
  EXPECT_GE(marked(marks, 0, floor), floor * 99 / 100);
  EXPECT_EQ(marked(marks, floor, cloud.size()), 0U);
}

TEST(LargePlanes, AreFoundUnderNoise) {
  PointCloud cloud;
  add_rectangle(cloud, {0, 0, 0}, kX, kY, 60, 60, 0.08F);
  EXPECT_GE(marked(on_large_planes(cloud, even(cloud), 30.0, Context(2)), 0, cloud.size()), cloud.size() * 95 / 100);
}

TEST(LargePlanes, AreJudgedByTheirExtentNotTheirArea) {
  PointCloud strip;
  add_rectangle(strip, {0, 0, 0}, kX, kY, 60, 3);
  EXPECT_EQ(marked(on_large_planes(strip, even(strip), 50.0, Context(2)), 0, strip.size()), strip.size());
  EXPECT_EQ(marked(on_large_planes(strip, even(strip), 65.0, Context(2)), 0, strip.size()), 0U);
}

// A drum's wall bends on from sample to sample, each flat to the next, but is no plane.
TEST(LargePlanes, AreNotWhatBendsGently) {
  PointCloud drum;
  const float radius = 40.0F;
  for (int i = 0; i < 251; ++i) {
    for (int j = 0; j < 60; ++j) {
      const float angle = static_cast<float>(i) / radius;
      const Eigen::Vector3f normal(std::cos(angle), std::sin(angle), 0.0F);
      drum.positions.push_back(radius * normal + static_cast<float>(j) * kZ);
      drum.normals.push_back(normal);
    }
  }
  EXPECT_EQ(marked(on_large_planes(drum, even(drum), 50.0, Context(2)), 0, drum.size()), 0U);
}

TEST(LargePlanes, DoNotDependOnTheSignOfNormals) {
  PointCloud cloud;
  add_rectangle(cloud, {0, 0, 0}, kX, kY, 60, 60);
  for (std::size_t i = 0; i < cloud.size(); i += 2) cloud.normals[i] = -cloud.normals[i];
  EXPECT_EQ(marked(on_large_planes(cloud, even(cloud), 30.0, Context(2)), 0, cloud.size()), cloud.size());
}

TEST(LargePlanes, AreTheSameForAnyNumberOfThreads) {
  PointCloud cloud;
  add_rectangle(cloud, {0, 0, 0}, kX, kY, 60, 60, 0.15F);
  add_rectangle(cloud, {0, 0, 12}, kX, kY, 20, 10, 0.15F);
  const auto expected = on_large_planes(cloud, even(cloud), 30.0, Context(1));
  EXPECT_EQ(on_large_planes(cloud, even(cloud), 30.0, Context(2)), expected);
  EXPECT_EQ(on_large_planes(cloud, even(cloud), 30.0, Context(3)), expected);
}

// A turning scanner measures the far end of a hall so sparsely that its samples are farther apart than those of the
// part.
TEST(LargePlanes, GoOnWhereTheScanIsSparse) {
  PointCloud cloud;
  add_rectangle(cloud, {0, 0, 0}, kX, kY, 60, 60);
  std::vector<float> spacings = even(cloud);
  const std::size_t near = cloud.size();
  add_rectangle(cloud, {112, 0, 0}, 4.0F * kX, 4.0F * kY, 40, 15, 0.5F);
  spacings.resize(cloud.size(), 4.0F);
  const auto marks = on_large_planes(cloud, spacings, 70.0, Context(2));
  EXPECT_GE(marked(marks, near, cloud.size()), (cloud.size() - near) * 95 / 100);
  EXPECT_GE(marked(marks, 0, near), near * 95 / 100)
      << "the near end alone is too small, but the far end goes on from it";
  EXPECT_EQ(marked(on_large_planes(cloud, even(cloud), 100.0, Context(2)), 0, cloud.size()), 0U)
      << "with one spacing for all, nothing links the far end";
}

TEST(LargePlanes, OfNothingAreNone) { EXPECT_TRUE(on_large_planes({}, {}, 30.0, Context(1)).empty()); }

}  // namespace
}  // namespace asbuilt::detect
