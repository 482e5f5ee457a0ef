// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/random.h"

namespace asbuilt {
namespace {

using Eigen::Vector3f;
using Neighbours = std::vector<KdTree::Neighbour>;

Vector3f random_point(Random& random) {
  return Eigen::Vector3d(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)).cast<float>();
}

// The distance exactly as single precision gives it, so that ties are the same ones that the tree sees.
float squared_distance(const Vector3f& a, const Vector3f& b) {
  float sum = 0.0F;
  for (int axis = 0; axis < 3; ++axis) sum += (a[axis] - b[axis]) * (a[axis] - b[axis]);
  return sum;
}

struct Cloud {
  const char* name;
  std::vector<Vector3f> points, directions;
};

// Scattered points; a lattice, where nearly every distance is a tie; points on a plane far from the origin, where
// floats are coarse; and many copies of few points.
std::vector<Cloud> clouds(std::uint64_t seed) {
  constexpr std::size_t kCount = 1500;
  std::vector<Cloud> all{{"scattered", {}, {}}, {"lattice", {}, {}}, {"far plane", {}, {}}, {"copies", {}, {}}};
  Random random(seed, "clouds", 0);
  std::vector<Vector3f> few;
  for (int i = 0; i < 20; ++i) few.push_back(random_point(random));
  for (std::size_t i = 0; i < kCount; ++i) {
    all[0].points.push_back(random_point(random));
    all[1].points.push_back((4.0F * random_point(random)).array().round().matrix() / 4.0F);
    all[2].points.push_back(random_point(random).cwiseProduct(Vector3f(1, 1, 0)) + Vector3f(1000, -2000, 500));
    all[3].points.push_back(few[random.below(few.size())]);
  }
  for (Cloud& cloud : all) {
    for (std::size_t i = 0; i < kCount; ++i) cloud.directions.push_back(random_point(random).normalized());
  }
  return all;
}

// All points within reach by distance, then index: what every query of the tree is a part of.
Neighbours brute_force(const std::vector<Vector3f>& points, const Vector3f& query, float squared_reach) {
  Neighbours found;
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    const float distance = squared_distance(points[i], query);
    if (distance <= squared_reach) found.push_back({i, distance});
  }
  std::ranges::sort(found, [](const auto& a, const auto& b) {
    return std::tie(a.squared_distance, a.index) < std::tie(b.squared_distance, b.index);
  });
  return found;
}

bool is_same(const KdTree::Neighbour& a, const KdTree::Neighbour& b) {
  return a.index == b.index && a.squared_distance == b.squared_distance;
}

class KdTreeOracle : public testing::Test {
 protected:
  // Calls check(cloud, tree, query) for random queries near each cloud and for queries at its points.
  template <class Check>
  void for_many_queries(const Check& check) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
      for (const Cloud& cloud : clouds(seed)) {
        const KdTree tree(cloud.points);
        Random random(seed, "queries", 0);
        for (int i = 0; i < 150; ++i) {
          SCOPED_TRACE(testing::Message() << cloud.name << ", seed " << seed << ", query " << i);
          const Vector3f& near = cloud.points[random.below(cloud.points.size())];
          check(cloud, tree, i % 3 == 0 ? near : Vector3f(near + 0.3F * random_point(random)), random);
          if (HasFatalFailure()) return;
        }
      }
    }
  }
};

TEST_F(KdTreeOracle, NearestIsThatOfBruteForce) {
  for_many_queries([](const Cloud& cloud, const KdTree& tree, const Vector3f& query, Random& random) {
    const auto expected = brute_force(cloud.points, query, std::numeric_limits<float>::max());
    ASSERT_TRUE(is_same(tree.nearest(query), expected.front()));
    const auto reach = static_cast<float>(random.uniform(0.0, 0.2));
    const auto within_reach = brute_force(cloud.points, query, reach * reach);
    const auto found = tree.nearest(query, reach);
    ASSERT_EQ(found.found(), !within_reach.empty());
    if (found.found()) {
      ASSERT_TRUE(is_same(found, within_reach.front()));
    }
  });
}

TEST_F(KdTreeOracle, NearestManyAreThoseOfBruteForce) {
  for_many_queries([](const Cloud& cloud, const KdTree& tree, const Vector3f& query, Random& random) {
    const std::size_t count = 1 + random.below(30);
    auto expected = brute_force(cloud.points, query, std::numeric_limits<float>::max());
    expected.resize(count);
    Neighbours found;
    tree.nearest(query, count, found);
    ASSERT_TRUE(std::ranges::equal(found, expected, is_same));
  });
}

TEST_F(KdTreeOracle, WithinIsThatOfBruteForceByIndex) {
  for_many_queries([](const Cloud& cloud, const KdTree& tree, const Vector3f& query, Random& random) {
    // Every other radius passes exactly through a point, which must be counted.
    const Vector3f& through = cloud.points[random.below(cloud.points.size())];
    const bool exact = random.below(2) == 0;
    const float radius = exact ? std::sqrt(squared_distance(through, query)) : static_cast<float>(random.uniform());
    auto expected = brute_force(cloud.points, query, radius * radius);
    std::ranges::sort(expected, {}, &KdTree::Neighbour::index);
    Neighbours found;
    tree.within(query, radius, found);
    ASSERT_TRUE(std::ranges::equal(found, expected, is_same)) << found.size() << " of " << expected.size();
  });
}

TEST_F(KdTreeOracle, NearestFacingIsThatOfBruteForce) {
  for_many_queries([](const Cloud& cloud, const KdTree& tree, const Vector3f& query, Random& random) {
    const Vector3f direction = random_point(random).normalized();
    const auto reach = static_cast<float>(random.uniform(0.0, 0.5));
    KdTree::Neighbour expected;
    for (const auto& candidate : brute_force(cloud.points, query, reach * reach)) {
      if (!(cloud.directions[candidate.index].dot(direction) > 0.7F)) continue;
      expected = candidate;
      break;
    }
    ASSERT_TRUE(is_same(tree.nearest_facing(query, reach, cloud.directions, direction, 0.7F), expected));
  });
}

TEST(KdTree, BuiltByAllThreadsAnswersAsOneBuiltByOne) {
  Random random(7, "many points", 0);
  std::vector<Vector3f> points;
  for (int i = 0; i < 120000; ++i) {
    const Vector3f point = random_point(random);
    points.push_back(i % 3 == 0 ? Vector3f((8.0F * point).array().round().matrix() / 8.0F) : point);
  }
  const KdTree one(points), all(points, Context(3));
  Neighbours expected, found;
  for (int i = 0; i < 3000; ++i) {
    const Vector3f query = random_point(random);
    one.nearest(query, 12, expected);
    all.nearest(query, 12, found);
    ASSERT_TRUE(std::ranges::equal(found, expected, is_same));
    one.within(query, 0.05F, expected);
    all.within(query, 0.05F, found);
    ASSERT_TRUE(std::ranges::equal(found, expected, is_same));
  }
  EXPECT_FALSE(KdTree(std::vector<Vector3f>(), Context(2)).nearest(points[0]).found());
}

}  // namespace
}  // namespace asbuilt
