// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/normals.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/scan/scan.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

Scan prepared(const PointCloud& raw, const ViewpointRequest& request, const ScanOptions& options = {}) {
  return prepare_scan(raw, std::nullopt, request, options, Context(2)).value();
}

TEST(Normals, OfAPlaneStandOnItAndFaceTheSensor) {
  const PointCloud raw = test::plane_cloud(60.0, 1.0, 20.0, 0.0, 1);
  for (const double side : {1.0, -1.0}) {
    const Scan scan = prepared(raw, test::from_point(5.0, -3.0, 20.0 + side * 200.0));
    EXPECT_TRUE(scan.normals_oriented);
    for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
      ASSERT_LT(test::degrees_between(scan.cloud.normals[i], {0, 0, side}), 0.01);
      ASSERT_LT(scan.surface_variation[i], 1e-6F);
    }
  }
}

TEST(Normals, OfASpherePointOutwardsFromASensorOutside) {
  // Twelve neighbours on a cap: its tilt is second order, what remains is their uneven spread.
  const Eigen::Vector3d centre(10.0, -20.0, 30.0);
  const PointCloud raw = test::sphere_cloud(centre, 50.0, 20000, 0.2, 0.0, 1);
  const Scan scan = prepared(raw, test::from_point(10.0, -20.0, 1000.0));
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    const Eigen::Vector3d outwards = (scan.cloud.positions[i].cast<double>() - centre).normalized();
    if (outwards.z() < 0.25) continue;  // at the rim the neighbours lie on one side
    ASSERT_LT(test::degrees_between(scan.cloud.normals[i], outwards), 1.0) << "point " << i;
  }
}

TEST(Normals, FaceAgainstParallelRays) {
  const PointCloud raw = test::sphere_cloud(Eigen::Vector3d::Zero(), 50.0, 5000, 0.1, 0.0, 1);
  const Scan scan = prepared(raw, test::stated(Viewpoint::Kind::direction, {0, 0, -1}));
  for (const Eigen::Vector3f& normal : scan.cloud.normals) ASSERT_GT(normal.z(), 0.0F);
}

TEST(Normals, FromTheFileGiveTheSignAndNothingElse) {
  PointCloud raw = test::plane_cloud(40.0, 1.0, 20.0, 0.0, 1);
  raw.normals.assign(raw.size(), Eigen::Vector3f(0.7F, 0.0F, -0.7F));  // 45 degrees off, pointing down
  const Scan scan = prepared(raw, test::stated(Viewpoint::Kind::none));
  EXPECT_TRUE(scan.normals_oriented);
  for (const Eigen::Vector3f& normal : scan.cloud.normals) {
    ASSERT_LT(test::degrees_between(normal, {0, 0, -1}), 0.01);
  }
}

TEST(Normals, HaveNoSignWithoutViewpointAndFileNormals) {
  PointCloud raw = test::plane_cloud(40.0, 1.0, 20.0, 0.0, 1);
  EXPECT_FALSE(prepared(raw, test::stated(Viewpoint::Kind::none)).normals_oriented);
  raw.normals.assign(raw.size(), Eigen::Vector3f(0, 0, 1));
  ScanOptions options;
  options.use_file_normals = false;
  EXPECT_FALSE(prepared(raw, test::stated(Viewpoint::Kind::none), options).normals_oriented);
}

TEST(Normals, OfNoisierScansUseMoreNeighbours) {
  EXPECT_EQ(neighbours_for_normals(0.0, 1.0), 12U);
  EXPECT_EQ(neighbours_for_normals(1.0, 0.0), 12U);
  EXPECT_EQ(neighbours_for_normals(100.0, 1.0), 60U);
  // n = 2 sqrt(pi) sigma / (slope spacing) for a slope of 0.05: the plane's slope then has sigma_slope = 0.05.
  EXPECT_EQ(neighbours_for_normals(0.5, 1.0), 36U);
}

TEST(Normals, TiltByAboutThreeDegreesWhateverTheNoise) {
  for (const double sigma : {0.25, 0.5, 0.8}) {
    const Scan scan = prepared(test::plane_cloud(80.0, 1.0, 20.0, sigma, 3), test::from_point(0, 0, 500));
    double squared = 0.0;
    for (const Eigen::Vector3f& normal : scan.cloud.normals) {
      const double tilt = test::degrees_between(normal, {0, 0, 1});
      squared += tilt * tilt / static_cast<double>(scan.cloud.size());
    }
    // Two axes of 0.05 rad each: 4 degrees RMS; twice that would say the formula is wrong.
    EXPECT_LT(std::sqrt(squared), 8.0) << "sigma " << sigma;
  }
}

// The plane through the nearest points found one by one; equally near ones by index.
PlaneFit by_brute_force(const std::vector<Eigen::Vector3f>& points, std::size_t i, std::size_t count) {
  std::vector<KdTree::Neighbour> all;
  for (std::uint32_t k = 0; k < points.size(); ++k) all.push_back({k, (points[k] - points[i]).squaredNorm()});
  std::ranges::sort(all, [](const auto& a, const auto& b) {
    return std::pair(a.squared_distance, a.index) < std::pair(b.squared_distance, b.index);
  });
  all.resize(std::min(count, all.size()));
  return fit_plane(points, all);
}

void expect_those_of_brute_force(const std::vector<Eigen::Vector3f>& points, std::size_t count) {
  const KdTree tree(points);
  const FittedNormals fitted = fitted_normals(points, tree, median_spacing(points, tree), count, Context(2));
  ASSERT_EQ(fitted.normals.size(), points.size());
  for (std::size_t i = 0; i < points.size(); i += 7) {
    const PlaneFit plane = by_brute_force(points, i, count);
    ASSERT_NEAR(fitted.variation[i], plane.variation, 1e-5F) << "point " << i;
    if (plane.variation > 0.2F) continue;  // hardly a plane: its normal may turn with the last digit
    ASSERT_GT(std::abs(fitted.normals[i].dot(plane.normal)), 0.9999F) << "point " << i;
  }
}

TEST(FittedNormals, AreThoseOfTheNearestPoints) {
  expect_those_of_brute_force(test::plane_cloud(60.0, 1.0, 20.0, 0.3, 5).positions, 12);
  expect_those_of_brute_force(test::sphere_cloud({0, 0, 600}, 80.0, 4000, -1.0, 0.2, 3).positions, 46);
}

// As a laser scanner's, near and far, with points that stand alone.
TEST(FittedNormals, AreThoseOfTheNearestPointsWhateverTheDensity) {
  std::vector<Eigen::Vector3f> points = test::plane_cloud(20.0, 0.2, 0.0, 0.02, 7).positions;
  for (const Eigen::Vector3f& far : test::plane_cloud(3000.0, 100.0, 2000.0, 5.0, 8).positions) points.push_back(far);
  points.emplace_back(0.0F, 0.0F, 500.0F);
  points.emplace_back(30000.0F, 0.0F, 500.0F);
  expect_those_of_brute_force(points, 20);
}

TEST(FittedNormals, OfEquallyNearPointsGoByTheIndex) {
  std::vector<Eigen::Vector3f> grid;
  for (int i = 0; i < 900; ++i) {
    grid.emplace_back(static_cast<float>(i % 30), static_cast<float>(i / 30), i % 2 == 0 ? 0.0F : 0.125F);
  }
  for (const std::size_t count : {6U, 7U, 12U, 30U}) expect_those_of_brute_force(grid, count);
}

TEST(FittedNormals, OfFewPointsAreThoseOfAll) {
  expect_those_of_brute_force(test::plane_cloud(5.0, 1.0, 20.0, 0.3, 5).positions, 60);
  const std::vector<Eigen::Vector3f> two{{0, 0, 0}, {1, 0, 0}};
  EXPECT_TRUE(fitted_normals(two, KdTree(two), 1.0, 12, Context(2)).normals[0].isZero(0.0F));
}

TEST(FittedNormals, AreTheSameWhateverTheThreads) {
  const std::vector<Eigen::Vector3f> points = test::sphere_cloud({0, 0, 600}, 80.0, 9000, -0.5, 0.2, 3).positions;
  const KdTree tree(points);
  const FittedNormals one = fitted_normals(points, tree, 1.0, 30, Context(1));
  const FittedNormals three = fitted_normals(points, tree, 1.0, 30, Context(3));
  EXPECT_EQ(one.variation, three.variation);
  EXPECT_TRUE(std::ranges::equal(one.normals, three.normals));
}

TEST(PlaneFit, OfFewerThanThreePointsIsNone) {
  const std::vector<Eigen::Vector3f> points{{0, 0, 0}, {1, 0, 0}};
  const std::vector<KdTree::Neighbour> two{{0, 0.0F}, {1, 1.0F}};
  EXPECT_TRUE(fit_plane(points, two).normal.isZero(0.0F));
}

TEST(PlaneFit, IsNotShakenByLargeCoordinates) {
  std::vector<Eigen::Vector3f> points;
  std::vector<KdTree::Neighbour> all;
  for (std::uint32_t i = 0; i < 25; ++i) {
    points.emplace_back(4096.0F + static_cast<float>(i % 5), 8192.0F + static_cast<float>(i / 5), 2048.0F);
    all.push_back({i, 0.0F});
  }
  const PlaneFit plane = fit_plane(points, all);
  EXPECT_NEAR(std::abs(plane.normal.z()), 1.0, 1e-6);
  EXPECT_NEAR(plane.variation, 0.0, 1e-9);
}

TEST(PlaneFit, VariationIsTheShareOfTheSmallestEigenvalue) {
  // Corners of a box with half extents 1, 2, 3: covariance diag(1, 4, 9).
  std::vector<Eigen::Vector3f> corners;
  std::vector<KdTree::Neighbour> all;
  for (std::uint32_t i = 0; i < 8; ++i) {
    corners.emplace_back((i & 1) != 0 ? 1.0F : -1.0F, (i & 2) != 0 ? 2.0F : -2.0F, (i & 4) != 0 ? 3.0F : -3.0F);
    all.push_back({i, 0.0F});
  }
  EXPECT_NEAR(fit_plane(corners, all).variation, 1.0 / 14.0, 1e-6);
}

}  // namespace
}  // namespace asbuilt::scan
