// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "asbuilt/scan/scan.h"
#include "support/matchers.h"
#include "unit/scan/clouds.h"

namespace asbuilt::scan {
namespace {

using test::FailsWith;

Result<Scan> prepared(std::vector<Eigen::Vector3f> points, const ScanOptions& options = {}) {
  return prepare_scan({std::move(points), {}}, std::nullopt, {}, options, Context(2));
}

void expect_sound(const Scan& scan) {
  for (const Eigen::Vector3f& normal : scan.cloud.normals) {
    ASSERT_TRUE(normal.isZero(0.0F) || std::abs(normal.norm() - 1.0F) < 1e-5F) << normal.transpose();
  }
  EXPECT_TRUE(std::isfinite(scan.noise_sigma_mm));
  EXPECT_TRUE(std::isfinite(scan.spacing_mm));
  const PointCloud samples = downsample(scan, 2.0, 2.0, Context(2));
  EXPECT_FALSE(samples.empty());
  for (const Eigen::Vector3f& normal : samples.normals) EXPECT_TRUE(normal.allFinite());
}

TEST(PrepareScan, RefusesAnEmptyCloud) { EXPECT_THAT(prepared({}), FailsWith(ErrorCode::unreadable_input)); }

TEST(PrepareScan, RefusesOnePoint) { EXPECT_THAT(prepared({{1, 2, 3}}), FailsWith(ErrorCode::unreadable_input)); }

TEST(PrepareScan, RefusesPointsThatAreAllEqualAndSaysSo) {
  const auto result = prepared(std::vector<Eigen::Vector3f>(500, Eigen::Vector3f(1, 2, 3)));
  ASSERT_THAT(result, FailsWith(ErrorCode::unreadable_input));
  EXPECT_THAT(result.error().message, testing::HasSubstr("499 duplicates"));
}

TEST(PrepareScan, RefusesACloudOfNaNs) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(prepared(std::vector<Eigen::Vector3f>(500, Eigen::Vector3f(nan, 0, 0))),
              FailsWith(ErrorCode::unreadable_input));
}

TEST(PrepareScan, SurvivesPointsOnALine) {
  std::vector<Eigen::Vector3f> line;
  for (int i = 1; i <= 200; ++i) line.emplace_back(0.5F * static_cast<float>(i), 0.0F, 0.0F);
  const auto scan = prepared(line);
  ASSERT_TRUE(scan.has_value());
  expect_sound(*scan);
  EXPECT_NEAR(scan->spacing_mm, 0.5, 1e-6);
}

TEST(PrepareScan, SurvivesThreePoints) {
  const auto scan = prepared({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  ASSERT_TRUE(scan.has_value());
  expect_sound(*scan);
}

TEST(PrepareScan, UsesTheNoiseThatIsStated) {
  ScanOptions options;
  options.noise_sigma_mm = 0.7;
  const auto scan = prepare_scan(test::plane_cloud(30.0, 1.0, 20.0, 0.1, 1), std::nullopt, {}, options, Context(1));
  EXPECT_EQ(scan.value().noise_sigma_mm, 0.7);
}

TEST(ScanOptions, RefuseImpossibleNoise) {
  for (const double noise : {-0.1, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    ScanOptions options;
    options.noise_sigma_mm = noise;
    EXPECT_THAT(options.validate(), FailsWith(ErrorCode::invalid_argument));
    EXPECT_THAT(prepared({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, options), FailsWith(ErrorCode::invalid_argument));
  }
}

TEST(PrepareScan, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  Context context(1);
  context.stop = source.get_token();
  const auto scan = prepare_scan(test::plane_cloud(30.0, 1.0, 20.0, 0.1, 1), std::nullopt, {}, {}, context);
  EXPECT_THAT(scan, FailsWith(ErrorCode::cancelled));
}

}  // namespace
}  // namespace asbuilt::scan
