// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>

#include "asbuilt/core/random.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt {
namespace {

using Eigen::Vector3f;

// Points on a unit sphere, more and more of them towards one pole: an uneven cloud.
std::vector<Vector3f> uneven_sphere(std::uint64_t seed, std::size_t count) {
  std::vector<Vector3f> points;
  Random random(seed, "sphere", 0);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal() + 1.5);
    points.push_back(direction.normalized().cast<float>());
  }
  return points;
}

std::array<int, 3> cube_of(const Vector3f& point, const Vector3f& low, double spacing) {
  std::array<int, 3> cube{};
  for (int axis = 0; axis < 3; ++axis) {
    cube[static_cast<std::size_t>(axis)] =
        static_cast<int>(std::floor((static_cast<double>(point[axis]) - static_cast<double>(low[axis])) / spacing));
  }
  return cube;
}

TEST(EvenSubsetProperty, HasOnePointOfEveryOccupiedCube) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const double spacing = 0.02 + 0.01 * static_cast<double>(seed);
    const std::vector<Vector3f> points = uneven_sphere(seed, 20'000);
    Vector3f low = points.front();
    for (const Vector3f& point : points) low = low.cwiseMin(point);
    std::map<std::array<int, 3>, int> chosen;
    for (const Vector3f& point : points) chosen[cube_of(point, low, spacing)] = 0;
    const std::vector<std::uint32_t> subset = even_subset(points, spacing, Context(2));
    for (const std::uint32_t index : subset) ++chosen[cube_of(points[index], low, spacing)];
    EXPECT_TRUE(std::ranges::all_of(chosen, [](const auto& cube) { return cube.second == 1; })) << "seed " << seed;
    EXPECT_TRUE(std::ranges::is_sorted(subset));
  }
}

TEST(EvenSubsetProperty, IsTheSameForAnyNumberOfThreads) {
  const std::vector<Vector3f> points = uneven_sphere(7, 150'000);
  const std::vector<std::uint32_t> expected = even_subset(points, 0.01, Context(1));
  for (const int threads : {2, 3, 8}) EXPECT_EQ(even_subset(points, 0.01, Context(threads)), expected) << threads;
}

TEST(EvenSubsetProperty, LeavesNoPointFurtherThanACubesDiagonal) {
  const double spacing = 0.1;
  const std::vector<Vector3f> points = uneven_sphere(11, 5'000);
  const std::vector<std::uint32_t> subset = even_subset(points, spacing, Context(2));
  for (const Vector3f& point : points) {
    float nearest = 10.0F;
    for (const std::uint32_t index : subset) nearest = std::min(nearest, (points[index] - point).norm());
    EXPECT_LE(nearest, std::sqrt(3.0) * spacing);
  }
}

}  // namespace
}  // namespace asbuilt
