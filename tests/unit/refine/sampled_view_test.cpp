// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/sampled_view.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/core/random.h"

namespace asbuilt::refine {
namespace {

// n by n points of a plane, 1 mm apart, with a hole of `hole` mm radius in the middle.
PointCloud plate(int n, double hole) {
  PointCloud cloud;
  for (int x = 0; x < n; ++x) {
    for (int y = 0; y < n; ++y) {
      if (std::hypot(x - n / 2, y - n / 2) < hole) continue;
      cloud.positions.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.0F);
      cloud.normals.emplace_back(0.0F, 0.0F, 1.0F);
    }
  }
  return cloud;
}

TEST(EvenlySampled, ComesWithinTenPercentOfTheCountAskedFor) {
  PointCloud cloud;
  for (std::uint64_t i = 0; i < 200000; ++i) {  // a sphere, far denser at one pole
    Random random(1, "dense pole", i);
    const double z = 1.0 - 2.0 * std::pow(random.uniform(), 3.0), turn = random.uniform(0.0, 6.2831853);
    const double r = std::sqrt(std::max(0.0, 1.0 - z * z));
    const Eigen::Vector3f d(static_cast<float>(r * std::cos(turn)), static_cast<float>(r * std::sin(turn)),
                            static_cast<float>(z));
    cloud.positions.push_back(100.0F * d);
    cloud.normals.push_back(d);
  }
  const PointCloud sample = evenly_sampled(cloud, 5000, Context(2));
  EXPECT_NEAR(static_cast<double>(sample.size()), 5000.0, 500.0);
  EXPECT_EQ(sample.normals.size(), sample.size());
  const auto upper = std::ranges::count_if(sample.positions, [](const auto& point) { return point.z() > 0.0F; });
  // 79 % of the cloud lies in the upper half, half of an even sample does.
  EXPECT_NEAR(static_cast<double>(upper) / static_cast<double>(sample.size()), 0.5, 0.05);
}

TEST(EvenlySampled, LeavesSmallCloudsWhole) {
  EXPECT_EQ(evenly_sampled(plate(10, 0.0), 5000, Context(1)).size(), 100U);
  EXPECT_EQ(evenly_sampled({}, 5000, Context(1)).size(), 0U);
  PointCloud in_one_place;
  in_one_place.positions.assign(1000, Eigen::Vector3f::Ones());
  EXPECT_GE(evenly_sampled(in_one_place, 100, Context(1)).size(), 1U);
}

TEST(BorderPoints, AreTheRimAndTheEdgeOfTheHole) {
  const PointCloud cloud = plate(41, 6.0);
  const KdTree tree(cloud.positions);
  const std::vector<Place> places = places_of(cloud, tree, 1.0, Context(2));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double x = cloud.positions[i].x(), y = cloud.positions[i].y();
    const double to_rim = std::min({x, y, 40.0 - x, 40.0 - y}), to_hole = std::hypot(x - 20.0, y - 20.0) - 6.0;
    if (to_rim == 0.0 || to_hole < 0.2) {
      EXPECT_EQ(places[i], Place::rim) << x << " " << y;
    }
    if (to_rim > 2.5 && to_hole > 2.5) {
      EXPECT_EQ(places[i], Place::inside) << x << " " << y;
    }
  }
}

TEST(BorderPoints, OfTwoScannedWallsAreAnEdgeAndNoRim) {
  PointCloud cloud;
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 40; ++j) {
      cloud.positions.emplace_back(static_cast<float>(i), static_cast<float>(j), 0.0F);
      cloud.normals.push_back(Eigen::Vector3f::UnitZ());
      if (j == 0) continue;
      cloud.positions.emplace_back(static_cast<float>(i), 0.0F, -static_cast<float>(j));
      cloud.normals.push_back(-Eigen::Vector3f::UnitY());
    }
  }
  const KdTree tree(cloud.positions);
  const std::vector<Place> places = places_of(cloud, tree, 1.0, Context(2));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f& p = cloud.positions[i];
    if (p.x() < 3.0F || p.x() > 37.0F) continue;
    if (p.y() == 0.0F && p.z() == 0.0F) {
      EXPECT_NE(places[i], Place::rim);
    }
    if (p.y() == 40.0F || p.z() == -40.0F) {
      EXPECT_EQ(places[i], Place::rim);
    }
  }
}

TEST(RimWeights, GiveUpNoMoreThanHalfOfAView) {
  const auto weights = [](int n) { return sampled_view(plate(n, 0.0), 0.0, {}, Context(2)).weight; };
  const auto sum = [](const std::vector<float>& all) {
    double total = 0.0;
    for (const float weight : all) total += static_cast<double>(weight);
    return total / static_cast<double>(all.size());
  };
  // 81 points wide, five and the rim itself on either side are near the rim: less than half of them.
  const std::vector<float> wide = weights(81), narrow = weights(25);
  EXPECT_FLOAT_EQ(*std::ranges::min_element(wide), 0.03F);
  EXPECT_GT(sum(wide), 0.5);
  // 25 wide, two thirds and more are near: they keep as much as makes half.
  EXPECT_NEAR(sum(narrow), 0.5, 1e-6);
  EXPECT_EQ(*std::ranges::max_element(narrow), 1.0F);
  // 9 wide, all are: they count alike.
  EXPECT_NEAR(sum(weights(9)), 0.5, 1e-6);
}

}  // namespace
}  // namespace asbuilt::refine
