// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/measured_cloud.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <limits>

#include "asbuilt/io/ply_writer.h"

namespace asbuilt::pipeline {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Five rows, of which the second repeats the first and the fourth is no point.
struct Rows {
  std::vector<float> x{1, 1, 2, kNaN, 3}, y{5, 5, 6, 7, 8}, z{9, 9, 9, 9, 9};
  std::vector<std::uint16_t> scan{4, 5, 6, 7, 8}, support{1, 2, 3, 4, 5};
  std::vector<float> sigma{0.1F, 0.2F, 0.3F, 0.4F, kNaN};

  [[nodiscard]] std::vector<io::PlyColumn> places() const {
    return {{"x", std::span<const float>(x)}, {"y", std::span<const float>(y)}, {"z", std::span<const float>(z)}};
  }
};

std::string written(const char* name, const std::vector<io::PlyColumn>& columns) {
  const auto path = std::filesystem::path(testing::TempDir()) / name;
  EXPECT_TRUE(io::write_ply(path, columns).has_value());
  return path.string();
}

TEST(MeasuredCloud, KeepsTheColumnsOfAReconstructionBesideThePointsThatRemain) {
  const Rows rows;
  auto columns = rows.places();
  columns.push_back({"scan", std::span<const std::uint16_t>(rows.scan)});
  columns.push_back({"support", std::span<const std::uint16_t>(rows.support)});
  columns.push_back({"sigma", std::span<const float>(rows.sigma)});
  const auto measured = measured_cloud(written("with_columns.ply", columns), LoadedModel{}, Options{}, Context(2));
  ASSERT_TRUE(measured.has_value()) << measured.error().message;
  ASSERT_EQ(measured->cloud.size(), 3U);
  EXPECT_EQ(measured->columns.scan, (std::vector<std::uint16_t>{4, 6, 8}));
  EXPECT_EQ(measured->columns.support, (std::vector<std::uint16_t>{1, 3, 5}));
  EXPECT_EQ(measured->columns.sigma_mm, (std::vector<float>{0.1F, 0.3F, 0.0F}));  // 0: unknown
}

TEST(MeasuredCloud, TakesTheStandardErrorInTheUnitOfTheCloud) {
  const Rows rows;
  auto columns = rows.places();
  columns.push_back({"sigma", std::span<const float>(rows.sigma)});
  Options options;
  options.scan_unit = io::Unit::metre;
  const auto measured = measured_cloud(written("in_metres.ply", columns), LoadedModel{}, options, Context(2));
  ASSERT_TRUE(measured.has_value()) << measured.error().message;
  EXPECT_EQ(measured->cloud.positions[1], Eigen::Vector3f(2000, 6000, 9000));
  ASSERT_EQ(measured->columns.sigma_mm.size(), 3U);
  EXPECT_NEAR(measured->columns.sigma_mm[1], 300.0F, 1e-3F);
}

TEST(MeasuredCloud, LeavesOutColumnsThatOtherCloudsHaveNotOrUseForSomethingElse) {
  const Rows rows;
  auto columns = rows.places();
  const auto plain = measured_cloud(written("plain.ply", columns), LoadedModel{}, Options{}, Context(2));
  ASSERT_TRUE(plain.has_value());
  EXPECT_TRUE(plain->columns.scan.empty());
  EXPECT_TRUE(plain->columns.support.empty());
  EXPECT_TRUE(plain->columns.sigma_mm.empty());
  const std::vector<float> angle{0.5F, 1, 2, 3, 4};  // "scan" as another program's scan angle
  columns.push_back({"scan", std::span<const float>(angle)});
  const auto other = measured_cloud(written("angle.ply", columns), LoadedModel{}, Options{}, Context(2));
  ASSERT_TRUE(other.has_value());
  EXPECT_EQ(other->cloud.size(), 3U);
  EXPECT_TRUE(other->columns.scan.empty());
}

}  // namespace
}  // namespace asbuilt::pipeline
