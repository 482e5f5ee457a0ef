// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/point_sieve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "asbuilt/core/random.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/io/scan_file.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::TemporaryFolder;

/// A square of 100 mm: the left half ten times as dense as the right.
std::vector<Eigen::Vector3f> uneven_square(std::size_t count, const Eigen::Vector3d& centre) {
  std::vector<Eigen::Vector3f> points;
  Random random(1, "square", 0);
  for (std::size_t i = 0; i < count; ++i) {
    const double x = i % 11 == 0 ? random.uniform(0.0, 50.0) : random.uniform(-50.0, 0.0);
    points.push_back((centre + Eigen::Vector3d(x, random.uniform(-50.0, 50.0), 0.0)).cast<float>());
  }
  return points;
}

std::filesystem::path written(const TemporaryFolder& folder, const std::vector<Eigen::Vector3f>& points) {
  std::array<std::vector<float>, 4> columns;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) columns[axis].push_back(points[i][static_cast<Eigen::Index>(axis)]);
    columns[3].push_back(static_cast<float>(i));
  }
  const std::vector<PlyColumn> named{{"x", std::span<const float>(columns[0])},
                                     {"y", std::span<const float>(columns[1])},
                                     {"z", std::span<const float>(columns[2])},
                                     {"intensity", std::span<const float>(columns[3])}};
  auto path = folder.path() / "scan.ply";
  EXPECT_TRUE(write_ply(path, named));
  return path;
}

PointSieve sieve_of(std::size_t capacity, std::function<bool(const Eigen::Vector3d&)> wants = {}) {
  PointSieve sieve;
  sieve.capacity = capacity;
  sieve.wants = std::move(wants);
  return sieve;
}

ReadOptions through(PointSieve sieve) {
  ReadOptions options;
  options.sieve = std::make_shared<const PointSieve>(std::move(sieve));
  return options;
}

TEST(PointSieve, LeavesAScanThatFitsAsItIs) {
  const TemporaryFolder folder;
  auto points = uneven_square(1000, {0, 0, 10});
  points[17] = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  points[18] = Eigen::Vector3f::Zero();
  const auto scan = read_scans(written(folder, points), through(sieve_of(1000))).value().front();
  ASSERT_EQ(scan.cloud.size(), 1000u);
  EXPECT_FALSE(scan.thinning);
  EXPECT_TRUE(std::isnan(scan.cloud.positions[17].x()));
  EXPECT_EQ(scan.cloud.positions[999], points[999]);
}

TEST(PointSieve, ThinsEvenlyAndWithinItsCapacity) {
  const TemporaryFolder folder;
  auto points = uneven_square(50000, {0, 0, 10});
  points[5] = Eigen::Vector3f::Zero();
  const auto scan = read_scans(written(folder, points), through(sieve_of(2000))).value().front();
  EXPECT_LE(scan.cloud.size(), 2000u);
  EXPECT_GE(scan.cloud.size(), 500u) << "far fewer than there is room for";
  ASSERT_TRUE(scan.thinning);
  EXPECT_EQ(scan.thinning->points_in_file, 49999u);
  // One point in each cube: none is double, and the sparse half keeps about as many as the dense one.
  std::set<std::pair<int, int>> cubes;
  std::size_t left = 0;
  for (const Eigen::Vector3f& p : scan.cloud.positions) {
    const double size = scan.thinning->spacing_mm;
    EXPECT_TRUE(cubes.insert({int(std::floor(double(p.x()) / size)), int(std::floor(double(p.y()) / size))}).second);
    left += p.x() < 0.0F ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(left) / static_cast<double>(scan.cloud.size()), 0.5, 0.1);
  // Attributes stay with their points.
  ASSERT_EQ(scan.intensities.size(), scan.cloud.size());
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    EXPECT_EQ(scan.cloud.positions[i], points[static_cast<std::size_t>(scan.intensities[i])]);
  }
}

TEST(PointSieve, KeepsWhatIsWantedWholeWhereThatFits) {
  const TemporaryFolder folder;
  const auto points = uneven_square(50000, {0, 0, 10});
  const auto wanted = [](const Eigen::Vector3d& p) { return p.head<2>().norm() < 5.0; };
  const auto scan = read_scans(written(folder, points), through(sieve_of(2000, wanted))).value().front();
  const auto expected = std::ranges::count_if(points, [&](const auto& p) { return wanted(p.template cast<double>()); });
  ASSERT_GT(expected, 100);
  EXPECT_EQ(static_cast<std::ptrdiff_t>(scan.cloud.size()), expected);
}

TEST(PointSieve, WantsPlacesInTheScanFrameAlsoWhereAnOffsetIsTakenOff) {
  const TemporaryFolder folder;
  const Eigen::Vector3d far(3e6, -2e6, 0.0);
  const std::size_t count = 4000;
  ScanFile scan;
  scan.name = "far";
  scan.cloud.positions = uneven_square(count, {0, 0, 0});
  scan.offset_mm = far;
  const auto wanted = [&](const Eigen::Vector3d& p) { return (p - far).head<2>().norm() < 10.0; };
  std::size_t expected = 0;
  for (const auto& p : scan.cloud.positions) expected += wanted(p.cast<double>() + far) ? 1 : 0;
  std::array<std::vector<double>, 3> columns;
  for (const auto& p : scan.cloud.positions) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      columns[axis].push_back(static_cast<double>(p[a]) + far[a]);
    }
  }
  const std::vector<PlyColumn> named{{"x", std::span<const double>(columns[0])},
                                     {"y", std::span<const double>(columns[1])},
                                     {"z", std::span<const double>(columns[2])}};
  ASSERT_TRUE(write_ply(folder.path() / "far.ply", named));
  const auto read = read_scans(folder.path() / "far.ply", through(sieve_of(count, wanted))).value().front();
  EXPECT_GT(expected, 10u);
  EXPECT_EQ(read.cloud.size(), expected);
}

TEST(PointSieve, SaysBeforehandHowManyPointsThereAreAndEndsWhenCancelled) {
  const TemporaryFolder folder;
  const auto path = written(folder, uneven_square(200000, {0, 0, 10}));
  std::uint64_t told = 0;
  double share = 0.0;
  PointSieve sieve = sieve_of(1000);
  sieve.announced = [&](std::uint64_t points) { told = points; };
  sieve.progress = [&](double done) { share = done; };
  sieve.cancelled = [&] { return share > 0.5; };
  const auto scan = read_scans(path, through(sieve)).value().front();
  EXPECT_EQ(told, 200000u);
  EXPECT_GT(share, 0.5);
  EXPECT_LT(share, 1.0);
}

}  // namespace
}  // namespace asbuilt::io
