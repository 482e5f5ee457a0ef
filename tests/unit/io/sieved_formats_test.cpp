// SPDX-License-Identifier: Apache-2.0
// Streamed reading of each format that can be streamed, against a sieve that goes point by point over the whole scan.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>

#include "asbuilt/core/random.h"
#include "asbuilt/io/e57_writer.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/scan_file.h"
#include "unit/io/bytes.h"
#include "unit/io/las_bytes.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::little;
using test::TemporaryFolder;

constexpr std::size_t kPoints = 150'000, kCapacity = 12'000;

/// A floor with a step, in mm, most of it near one corner; every 97th ray comes back without a point.
std::vector<Eigen::Vector3f> floor_with_step() {
  std::vector<Eigen::Vector3f> points;
  Random random(3, "floor", 0);
  for (std::size_t i = 0; i < kPoints; ++i) {
    const double x = 900.0 * std::pow(random.uniform(0.0, 1.0), 2.0), y = random.uniform(-400.0, 400.0);
    points.push_back(Eigen::Vector3d(x, y, x > 300.0 ? 80.0 : 20.0).cast<float>());
    if (i % 97 == 0) points.back().setZero();
  }
  return points;
}

std::string ply_bytes() {
  const auto points = floor_with_step();
  std::string bytes = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar "
                      "green\nproperty uchar blue\nproperty float intensity\nend_header\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const float value : points[i]) bytes += little(value);
    bytes += little(static_cast<std::uint8_t>(i)) + little(std::uint8_t{7}) + little(std::uint8_t{9});
    bytes += little(static_cast<float>(i));
  }
  return bytes;
}

std::string pcd_bytes() {
  auto points = floor_with_step();
  points[5].setConstant(std::numeric_limits<float>::quiet_NaN());
  const std::string count = std::to_string(points.size());
  std::string bytes =
      "VERSION 0.7\nFIELDS x y z normal_x normal_y normal_z intensity\nSIZE 4 4 4 4 4 4 4\nTYPE F F F F "
      "F F F\nCOUNT 1 1 1 1 1 1 1\nWIDTH " +
      count + "\nHEIGHT 1\nPOINTS " + count + "\nDATA binary\n";
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const float value : points[i]) bytes += little(value);
    for (const float value : {0.0F, static_cast<float>(i), 1.0F}) bytes += little(value);
    bytes += little(static_cast<float>(i));
  }
  return bytes;
}

std::string las_bytes(double offset) {
  std::vector<std::array<int, 3>> raw;
  for (const Eigen::Vector3f& point : floor_with_step()) {
    raw.push_back({static_cast<int>(100.0F * point.x()), static_cast<int>(50.0F * point.y()),
                   static_cast<int>(1000.0F * point.z())});
  }
  return test::las(3, 2, raw, offset);
}

std::filesystem::path write_e57_scan(const TemporaryFolder& folder, double offset_mm) {
  E57Scan scan;
  scan.name = "floor";
  for (const Eigen::Vector3f& point : floor_with_step()) {
    scan.positions_mm.push_back(point.cast<double>() + Eigen::Vector3d(offset_mm, 0.0, 0.0));
    scan.intensities.push_back(static_cast<float>(scan.intensities.size()));
    scan.colours.push_back({static_cast<std::uint8_t>(scan.colours.size()), 1, 2});
    scan.normals.emplace_back(0.0F, 0.0F, static_cast<float>(scan.normals.size()));
  }
  scan.positions_mm[11].setConstant(std::numeric_limits<double>::quiet_NaN());
  auto path = folder.path() / "floor.e57";
  EXPECT_TRUE(write_e57(path, std::vector{scan}));
  return path;
}

using Wants = std::function<bool(const Eigen::Vector3d&)>;

/// The places of the points that stay, by the words of point_sieve.h and nothing else.
class PlainSieve {
 public:
  PlainSieve(const ScanFile& whole, const Wants& wants) : points_(whole.cloud.positions) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (wants && !(is_point(i) && wants(points_[i].cast<double>() + whole.offset_mm))) continue;
      if (size_ > 0.0 && !is_point(i)) continue;
      if (staying.size() == kCapacity) make_room();
      if (size_ > 0.0 && !(is_point(i) && is_first(i))) continue;
      staying.push_back(i);
    }
  }
  std::vector<std::size_t> staying;
  [[nodiscard]] double size_mm() const { return size_; }

 private:
  [[nodiscard]] bool is_point(std::size_t i) const { return points_[i].allFinite() && !points_[i].isZero(0.0F); }
  bool is_first(std::size_t i) {
    const Eigen::Vector3d cube = (points_[i].cast<double>() / size_).array().floor();
    return cubes_.insert({cube.x(), cube.y(), cube.z()}).second;
  }
  void make_room() {
    Eigen::AlignedBox3f box;
    for (const std::size_t i : staying) {
      if (is_point(i)) box.extend(points_[i]);
    }
    const auto extent = static_cast<double>(box.sizes().maxCoeff());
    size_ = size_ > 0.0 ? size_ * std::numbers::sqrt2 : 0.1 * extent / std::sqrt(static_cast<double>(kCapacity));
    for (;; size_ *= std::numbers::sqrt2) {
      cubes_.clear();
      std::erase_if(staying, [&](std::size_t i) { return !(is_point(i) && is_first(i)); });
      if (2 * staying.size() <= kCapacity) return;
    }
  }

  const std::vector<Eigen::Vector3f>& points_;
  std::set<std::array<double, 3>> cubes_;
  double size_ = 0.0;
};

template <class T>
std::vector<T> picked(const std::vector<T>& all, const std::vector<std::size_t>& places) {
  std::vector<T> values;
  for (const std::size_t place : places) {
    if (!all.empty()) values.push_back(all[place]);
  }
  return values;
}

/// Equal bits, NaN too.
std::string bits_of(const std::vector<Eigen::Vector3f>& points) {
  return {reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Eigen::Vector3f)};
}

void expect_the_same_as_point_by_point(const std::filesystem::path& path, const Wants& wants) {
  SCOPED_TRACE(path.filename().string() + (wants ? ", some wanted" : ""));
  const ScanFile whole = read_scans(path, Unit::stated).value().front();
  ASSERT_EQ(whole.cloud.size(), kPoints);
  const PlainSieve expected(whole, wants);
  ASSERT_GT(expected.size_mm(), 0.0) << "there is nothing to be thinned";
  for (const int threads : {1, 2, 5}) {
    PointSieve sieve;
    sieve.capacity = kCapacity;
    sieve.wants = wants;
    ReadOptions options;
    options.sieve = std::make_shared<const PointSieve>(sieve);
    options.context.emplace(threads);
    const ScanFile scan = read_scans(path, options).value().front();
    EXPECT_EQ(scan.offset_mm, whole.offset_mm);
    EXPECT_EQ(bits_of(scan.cloud.positions), bits_of(picked(whole.cloud.positions, expected.staying)));
    EXPECT_EQ(bits_of(scan.cloud.normals), bits_of(picked(whole.cloud.normals, expected.staying)));
    EXPECT_EQ(scan.colours, picked(whole.colours, expected.staying));
    EXPECT_EQ(scan.intensities, picked(whole.intensities, expected.staying));
    ASSERT_TRUE(scan.thinning);
    EXPECT_EQ(scan.thinning->spacing_mm, expected.size_mm());
    std::size_t points = 0;
    for (const Eigen::Vector3f& p : whole.cloud.positions) points += p.allFinite() && !p.isZero(0.0F) ? 1 : 0;
    EXPECT_EQ(scan.thinning->points_in_file, points);
  }
}

void expect_the_same(const std::filesystem::path& path, double offset_mm = 0.0) {
  expect_the_same_as_point_by_point(path, {});
  expect_the_same_as_point_by_point(
      path, [offset_mm](const Eigen::Vector3d& point_in_scan) { return point_in_scan.x() - offset_mm < 250.0; });
}

void expect_the_same(const std::string& name, const std::string& bytes, double offset_mm = 0.0) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_file(folder.path() / name, bytes));
  expect_the_same(folder.path() / name, offset_mm);
}

TEST(SievedFormats, PlyIsSiftedAsPointByPoint) { expect_the_same("floor.ply", ply_bytes()); }

TEST(SievedFormats, PcdIsSiftedAsPointByPoint) { expect_the_same("floor.pcd", pcd_bytes()); }

TEST(SievedFormats, LasIsSiftedAsPointByPoint) {
  expect_the_same("floor.las", las_bytes(0.0));
  expect_the_same("far.las", las_bytes(5e6), 5e6);
}

TEST(SievedFormats, E57IsSiftedAsPointByPoint) {
  const TemporaryFolder folder;
  expect_the_same(write_e57_scan(folder, 0.0));
  expect_the_same(write_e57_scan(folder, 3e6), 3e6);
}

}  // namespace
}  // namespace asbuilt::io
