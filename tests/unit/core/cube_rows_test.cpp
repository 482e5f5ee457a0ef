// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/cube_rows.h"

#include <gtest/gtest.h>

#include <limits>
#include <set>

#include "asbuilt/core/random.h"

namespace asbuilt {
namespace {

std::vector<Eigen::Vector3f> scattered(std::size_t count, std::uint64_t seed) {
  Random random(seed, "cubes", 0);
  std::vector<Eigen::Vector3f> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random.uniform(-40, 60), y = random.uniform(0, 7), z = random.uniform(-3, 90);
    points.emplace_back(Eigen::Vector3d(x, y, z).cast<float>());
  }
  return points;
}

TEST(CubeRows, FindsAllThatBruteForceFinds) {
  const auto points = scattered(3000, 1);
  const CubeRows cubes(points, 4.0);
  Random random(2, "queries", 0);
  for (int k = 0; k < 200; ++k) {
    const double x = random.uniform(-60, 80), y = random.uniform(-10, 17), z = random.uniform(-20, 110);
    const Eigen::Vector3f centre = Eigen::Vector3d(x, y, z).cast<float>();
    const auto radius = static_cast<float>(random.uniform(0.5, 15.0));
    std::set<std::uint32_t> found;
    cubes.around(centre, radius, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) found.insert(cubes.order()[i]);
    });
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      if ((points[i] - centre).norm() > radius) continue;
      EXPECT_TRUE(found.contains(i)) << "query " << k << ", point " << i;
    }
  }
}

TEST(CubeRows, OrdersEveryFinitePointOnce) {
  auto points = scattered(500, 3);
  points[7].x() = std::numeric_limits<float>::quiet_NaN();
  const CubeRows cubes(points, 1e-3);  // far more cubes than it allows itself
  const std::set<std::uint32_t> all(cubes.order().begin(), cubes.order().end());
  EXPECT_EQ(all.size(), 499U);
  EXPECT_EQ(cubes.order().size(), 499U);
  EXPECT_FALSE(all.contains(7));
}

TEST(CubeRows, OfNothingFindNothing) {
  const CubeRows cubes({}, 1.0);
  cubes.around(Eigen::Vector3f::Zero(), 5.0F, [](std::size_t, std::size_t) { FAIL(); });
}

}  // namespace
}  // namespace asbuilt
