// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/point_grid.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <set>

#include "asbuilt/core/random.h"

namespace asbuilt::fuse {
namespace {

TEST(PointGrid, VisitsEveryPointWithinACellOfTheCentreExactlyOnce) {
  std::vector<Eigen::Vector3f> points;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(1, "grid", i);
    points.emplace_back(static_cast<float>(random.uniform(-10, 10)), static_cast<float>(random.uniform(-10, 10)),
                        static_cast<float>(random.uniform(-10, 10)));
  }
  const PointGrid grid(points, 1.5, Context(2));
  for (std::size_t i = 0; i < points.size(); i += 7) {
    std::multiset<std::uint32_t> visited;
    grid.around_until(points[i], [&](std::uint32_t j) {
      visited.insert(j);
      return false;
    });
    for (std::uint32_t j = 0; j < points.size(); ++j) {
      EXPECT_LE(visited.count(j), 1U);
      if ((points[j] - points[i]).norm() <= 1.5F) {
        EXPECT_EQ(visited.count(j), 1U) << i << " " << j;
      }
    }
  }
}

TEST(PointGrid, VisitsWhatLiesBesideALine) {
  std::vector<Eigen::Vector3f> points;
  for (std::uint64_t i = 0; i < 2000; ++i) {
    Random random(2, "grid", i);
    points.emplace_back(static_cast<float>(random.uniform(-5, 5)), static_cast<float>(random.uniform(-5, 5)),
                        static_cast<float>(random.uniform(-5, 5)));
  }
  const PointGrid grid(points, 2.0, Context(2));
  const Eigen::Vector3f direction = Eigen::Vector3f(1, 2, -1).normalized();
  for (std::size_t i = 0; i < points.size(); i += 11) {
    std::multiset<std::uint32_t> visited;
    grid.along(points[i], direction, 0.5F, [&](std::uint32_t j) {
      visited.insert(j);
      return false;
    });
    for (std::uint32_t j = 0; j < points.size(); ++j) {
      const Eigen::Vector3f offset = points[j] - points[i];
      const float aside = offset.cross(direction).norm();
      if (aside < 0.499F && offset.norm() < 2.0F) {
        EXPECT_EQ(visited.count(j), 1U) << i << " " << j;
      }
      if (aside > 0.501F) {
        EXPECT_EQ(visited.count(j), 0U) << i << " " << j;
      }
    }
  }
}

TEST(PointGrid, StopsWhenTheVisitorHasSeenEnough) {
  const std::vector<Eigen::Vector3f> points(50, Eigen::Vector3f::Zero());
  const PointGrid grid(points, 1.0, Context(1));
  int seen = 0;
  grid.around_until(points[0], [&](std::uint32_t) { return ++seen == 3; });
  EXPECT_EQ(seen, 3);
}

TEST(PointGrid, OfNoPointsHasNoNeighbours) {
  const PointGrid grid({}, 1.0, Context(1));
  int seen = 0;
  grid.around_until(Eigen::Vector3f::Zero(), [&](std::uint32_t) { return ++seen > 0; });
  grid.along(Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitZ(), 1.0F, [&](std::uint32_t) { return ++seen > 0; });
  EXPECT_EQ(seen, 0);
}

}  // namespace
}  // namespace asbuilt::fuse
