// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <tuple>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/scan/scan.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

Scan noisy_plane(double sigma = 0.3) {
  return prepare_scan(test::plane_cloud(100.0, 1.0, 20.0, sigma, 5), std::nullopt, test::from_point(0, 0, 400), {},
                      Context(2))
      .value();
}

TEST(Downsample, GivesScanPointsSpreadEvenly) {
  const Scan scan = noisy_plane();
  const double spacing = 5.0;
  const PointCloud samples = downsample(scan, spacing, 5.0, Context(2));
  // One a cube that the plane crosses: 20 x 20, a row more for an unlucky grid, and again where noise enters a second
  // layer of cubes.
  EXPECT_GE(samples.size(), 400U);
  EXPECT_LE(samples.size(), 2U * 21U * 21U);

  std::set<std::tuple<float, float, float>> known;
  for (const Eigen::Vector3f& p : scan.cloud.positions) known.insert({p.x(), p.y(), p.z()});
  for (const Eigen::Vector3f& p : samples.positions) EXPECT_TRUE(known.contains({p.x(), p.y(), p.z()}));

  // Each point shares a cube with a sample.
  const KdTree tree(samples.positions);
  for (const Eigen::Vector3f& p : scan.cloud.positions) {
    ASSERT_LE(std::sqrt(tree.nearest(p).squared_distance), std::sqrt(3.0) * spacing);
  }
}

TEST(Downsample, FitsNormalsOverTheRadiusItIsGiven) {
  const Scan scan = noisy_plane();
  const PointCloud samples = downsample(scan, 5.0, 8.0, Context(2));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples.positions[i].head<2>().cwiseAbs().maxCoeff() > 42.0F) continue;  // half discs at the border
    // Thinned to 150 points over 8 mm: sigma_slope = 2 * 0.3 / (8 * sqrt(150)) = 0.35 degrees; five times that.
    ASSERT_LT(test::degrees_between(samples.normals[i], {0, 0, 1}), 1.75);
  }
}

TEST(Downsample, KeepsNormalsTurnedToTheSensor) {
  const PointCloud raw = test::sphere_cloud(Eigen::Vector3d::Zero(), 50.0, 20000, 0.2, 0.1, 2);
  const Viewpoint above{Viewpoint::Kind::point, {0, 0, 400}};
  const Scan scan = prepare_scan(raw, std::nullopt, {false, above}, {}, Context(2)).value();
  const PointCloud samples = downsample(scan, 8.0, 12.0, Context(2));
  for (std::size_t i = 0; i < samples.size(); ++i) {
    ASSERT_GE(above.towards_sensor(samples.positions[i].cast<double>()).dot(samples.normals[i].cast<double>()), 0.0);
  }
}

TEST(Downsample, FinerThanTheScanReturnsTheWholeScan) {
  const Scan scan = noisy_plane();
  EXPECT_EQ(downsample(scan, 1e-3, 3.0, Context(2)).size(), scan.cloud.size());
}

TEST(PrepareScan, GivesTheSameBytesForAnyNumberOfThreads) {
  PointCloud raw = test::sphere_cloud({0, 0, 500}, 80.0, 40000, -2.0, 0.2, 4);
  for (const Eigen::Vector3f& p : test::plane_cloud(300.0, 2.0, 620.0, 0.2, 4).positions) raw.positions.push_back(p);
  const auto run = [&](int threads) {
    const Context context(threads);
    const Scan scan = prepare_scan(raw, std::nullopt, test::from_point(0, 0, 0), {}, context).value();
    return std::tuple(scan, downsample(scan, 8.0, 8.0, context));
  };
  const auto [scan, samples] = run(1);
  for (const int threads : {2, 3}) {
    const auto [other_scan, other_samples] = run(threads);
    EXPECT_EQ(other_scan.cloud.positions, scan.cloud.positions);
    EXPECT_EQ(other_scan.cloud.normals, scan.cloud.normals);
    EXPECT_EQ(other_scan.surface_variation, scan.surface_variation);
    EXPECT_EQ(other_scan.source_index, scan.source_index);
    EXPECT_EQ(other_scan.noise_sigma_mm, scan.noise_sigma_mm);
    EXPECT_EQ(other_scan.spacing_mm, scan.spacing_mm);
    EXPECT_EQ(other_samples.positions, samples.positions);
    EXPECT_EQ(other_samples.normals, samples.normals);
  }
}

}  // namespace
}  // namespace asbuilt::scan
