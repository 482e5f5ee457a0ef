// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/search_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>

#include "asbuilt/core/voxel_grid.h"
#include "unit/detect/oriented_points.h"
#include "unit/scan/camera.h"

namespace asbuilt::pipeline {
namespace {

using Cell = std::tuple<int, int, int>;

const model::PreparedModel& model() {
  static const model::PreparedModel the_model = test::small_model(0.04);
  return the_model;
}

/// A noisy square, its sides at right angles to x, y and z in turn, `across` points wide.
std::vector<Eigen::Vector3f> noisy_square(int across, double spacing, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, sigma);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < across; ++i) {
    for (int j = 0; j < across; ++j) {
      points.push_back(Eigen::Vector3d(spacing * i, spacing * j, 700.0 + noise(random)).cast<float>());
    }
  }
  return points;
}

double spread_of_height(const std::vector<Eigen::Vector3f>& points, std::span<const std::uint32_t> at) {
  double sum = 0.0, squares = 0.0;
  for (const std::uint32_t i : at) {
    const double height = static_cast<double>(points[i].z()) - 700.0;
    sum += height, squares += height * height;
  }
  const auto n = static_cast<double>(at.size());
  return std::sqrt(squares / n - sum / n * (sum / n));
}

TEST(SearchPoints, OfEachCubeTheShareStaysThatLeavesSixteenInTheFullestAround) {
  const detect::DetectOptions options;
  const double cube = 4.0 * options.search_spacing_ratio * model().sampling_distance;
  std::vector<Eigen::Vector3f> points = noisy_square(600, cube / 12.0, 0.02 * cube, 1);
  // A patch far away that is sparse, and rows that are no points.
  for (int i = 0; i < 100; ++i) points.emplace_back(static_cast<float>(cube) * static_cast<float>(i), 5000.0F, 0.0F);
  points.emplace_back(0.0F, 0.0F, 0.0F);
  points.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F);
  const auto staying = search_points(points, model(), options, Context(2));
  ASSERT_TRUE(staying.has_value());
  EXPECT_TRUE(std::ranges::is_sorted(*staying));

  // By brute force; the cubes are counted from the lowest measured coordinates.
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i + 2 < points.size(); ++i) low = low.cwiseMin(points[i].cast<double>());
  const auto cell_of = [&](const Eigen::Vector3f& point) {
    const Eigen::Vector3d cell = ((point.cast<double>() - low) / cube).array().floor();
    return Cell(static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z()));
  };
  std::map<Cell, int> there, kept;
  for (std::size_t i = 0; i + 2 < points.size(); ++i) ++there[cell_of(points[i])];
  for (const std::uint32_t i : *staying) ++kept[cell_of(points[i])];
  double expected = 0.0;
  for (const auto& [cell, count] : there) {
    int most = 16;
    for (int side = 0; side < 27; ++side) {
      const auto [x, y, z] = cell;
      const auto other = there.find(Cell(x + side % 3 - 1, y + side / 3 % 3 - 1, z + side / 9 - 1));
      if (other != there.end()) most = std::max(most, other->second);
    }
    const double share = 16.0 * count / most;
    expected += share;
    ASSERT_GE(kept[cell], static_cast<int>(std::floor(share)));
    ASSERT_LE(kept[cell], static_cast<int>(std::ceil(share)));
  }
  EXPECT_NEAR(static_cast<double>(staying->size()) / expected, 1.0, 0.02);
}

TEST(SearchPoints, AreAsNoisyAsAllPoints) {
  const double spacing = model().sampling_distance / 40.0, sigma = 2.0 * spacing;
  const std::vector<Eigen::Vector3f> points = noisy_square(700, spacing, sigma, 2);
  const auto staying = search_points(points, model(), {}, Context(2));
  ASSERT_TRUE(staying.has_value());
  EXPECT_LT(2 * staying->size(), points.size());
  EXPECT_NEAR(spread_of_height(points, *staying), sigma, 0.05 * sigma);
}

TEST(SearchPoints, AreAllOfAScanThatIsNotFarDenserThanTheyAre) {
  const double spacing = 0.07 * model().sampling_distance;
  EXPECT_FALSE(search_points(noisy_square(400, spacing, 0.1 * spacing, 3), model(), {}, Context(2)).has_value());
}

TEST(SearchPoints, AreAllWhereHardlyAnyWouldStay) {  // as of a scan in metres beside a model in millimetres
  const double spacing = 1e-4 * model().sampling_distance;
  EXPECT_FALSE(search_points(noisy_square(400, spacing, 0.1 * spacing, 4), model(), {}, Context(2)).has_value());
}

TEST(SearchPoints, AreAllInPaperModeAndWhenTheOptionsSaySo) {
  const std::vector<Eigen::Vector3f> points = noisy_square(600, model().sampling_distance / 40.0, 0.1, 5);
  ASSERT_TRUE(search_points(points, model(), {}, Context(2)).has_value());
  EXPECT_FALSE(search_points(points, model(), detect::DetectOptions{}.as_published(), Context(2)).has_value());
  detect::DetectOptions never;
  never.search_spacing_ratio = 0.0;
  EXPECT_FALSE(search_points(points, model(), never, Context(2)).has_value());
}

// What is sought in is as dense everywhere, which hides where the camera stood; all points together tell it.
TEST(PrepareSearch, LooksForTheViewpointInAllPoints) {
  const Eigen::Vector3d camera(-40, 30, 0);
  const Pose motion =
      Eigen::Translation3d(900, -2500, 400) * Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, 3).normalized());
  PointCloud all, sought;
  for (const Eigen::Vector3f& point : test::seen_by_camera(camera, 400)) {
    all.positions.push_back((motion * point.cast<double>()).cast<float>());
  }
  for (const std::uint32_t i : even_subset(all.positions, 9.0, Context(2)))
    sought.positions.push_back(all.positions[i]);
  ASSERT_FALSE(scan::prepare_scan(sought, std::nullopt, {}, {}, Context(2)).value().viewpoint.known());

  const scan::Scan scan = prepare_search(sought, all, std::nullopt, {}, {}, Context(2)).value();
  EXPECT_EQ(scan.cloud.size(), sought.size());
  EXPECT_EQ(scan.viewpoint_source, scan::ViewpointSource::points);
  EXPECT_LT((scan.viewpoint.value - motion * camera).norm(), 0.15 * test::kBall.z());
  EXPECT_TRUE(scan.normals_oriented);

  const scan::ViewpointRequest nothing{false, {}};
  EXPECT_FALSE(prepare_search(sought, all, std::nullopt, nothing, {}, Context(2)).value().viewpoint.known());
}

// A hall is in order from anywhere within, and what was thinned has no density left.
TEST(PrepareSearch, DoesNotBelieveAnOriginElsewhereInTheRoom) {
  const Eigen::Vector3d tripod(-2000, -1000, 0);
  PointCloud all, sought;
  all.positions = test::seen_from_tripod(tripod, 0.3);
  for (const std::uint32_t i : even_subset(all.positions, 120.0, Context(2)))
    sought.positions.push_back(all.positions[i]);
  ASSERT_EQ(scan::prepare_scan(sought, std::nullopt, {}, {}, Context(2)).value().viewpoint_source,
            scan::ViewpointSource::origin);
  const scan::Scan scan = prepare_search(sought, all, std::nullopt, {}, {}, Context(2)).value();
  ASSERT_EQ(scan.viewpoint_source, scan::ViewpointSource::points);
  EXPECT_LT((scan.viewpoint.value - tripod).norm(), 400.0);  // a tenth of the usual range
}

}  // namespace
}  // namespace asbuilt::pipeline
