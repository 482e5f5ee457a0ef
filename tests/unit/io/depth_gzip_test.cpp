// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/scan_file.h"
#include "unit/io/png_bytes.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;

const std::filesystem::path kBunny = std::filesystem::path(ASBUILT_DATA_DIR) / "tum_bunny";

/// Rows of the depths, filtered as the PNG specification writes it down, with filter `row % 5`.
std::string filtered(const std::vector<std::vector<std::uint16_t>>& rows) {
  std::string all;
  std::string above(2 * rows.front().size(), '\0');
  for (std::size_t y = 0; y < rows.size(); ++y) {
    std::string raw;
    for (const std::uint16_t value : rows[y]) raw += test::big(value);
    const int filter = static_cast<int>(y % 5);
    all += static_cast<char>(filter);
    for (std::size_t i = 0; i < raw.size(); ++i) {
      const auto at = [&](const std::string& row, std::size_t k) { return int{static_cast<unsigned char>(row[k])}; };
      const int a = i >= 2 ? at(raw, i - 2) : 0, b = at(above, i), c = i >= 2 ? at(above, i - 2) : 0;
      const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
      const int paeth = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
      const int predicted[] = {0, a, b, (a + b) / 2, paeth};
      all += static_cast<char>(at(raw, i) - predicted[filter]);
    }
    above = raw;
  }
  return all;
}

TEST(DepthImage, PixelsBecomePointsThroughTheCameraWhateverTheirFilter) {
  std::vector<std::vector<std::uint16_t>> rows(7, std::vector<std::uint16_t>(4));
  for (std::size_t y = 0; y < 7; ++y) {
    for (std::size_t x = 0; x < 4; ++x)
      rows[y][x] = static_cast<std::uint16_t>(x == 2 ? 0 : 1000 * y + 37 * x * x + 300);
  }
  const TemporaryFolder folder;
  ReadOptions options;
  options.camera = "500,400,1.5,3";
  const auto scans = read_scans(folder.file("depth.png", test::png(4, 7, filtered(rows))), options);
  ASSERT_TRUE(scans) << scans.error().message;
  const ScanFile& scan = scans->front();
  ASSERT_EQ(scan.cloud.size(), 28u);
  EXPECT_EQ(scan.grid->columns, 4u);
  EXPECT_EQ(*scan.viewpoint_mm, Eigen::Vector3d::Zero());
  for (std::size_t y = 0; y < 7; ++y) {
    for (std::size_t x = 0; x < 4; ++x) {
      const double depth = rows[y][x];
      const Eigen::Vector3d expected((static_cast<double>(x) - 1.5) / 500 * depth,
                                     (static_cast<double>(y) - 3) / 400 * depth, depth);
      EXPECT_LT((scan.cloud.positions[4 * y + x].cast<double>() - expected).norm(), 1e-3);
    }
  }
}

TEST(DepthImage, FindsItsCameraBesideIt) {
  const TemporaryFolder folder;
  const auto path = folder.file("depth.png", test::png(1, 1, std::string("\0\x03\xe8", 3)));
  const auto without = read_scans(path, Unit::stated);
  ASSERT_FALSE(without);
  EXPECT_THAT(without.error().message, HasSubstr("--camera"));
  (void)folder.file("intrinsic.txt", "500 0 -1\n0 500 0\n0 0 1");
  const auto by_rows = read_scans(path, Unit::stated);
  ASSERT_TRUE(by_rows) << by_rows.error().message;
  EXPECT_NEAR(by_rows->front().cloud.positions[0].x(), 2.0, 1e-6);
  (void)folder.file("intrinsic.txt", R"({"width": 1, "height": 1, "intrinsic_matrix": [500,0,0,0,500,0,-1,0,1]})");
  const auto by_columns = read_scans(path, Unit::stated);
  ASSERT_TRUE(by_columns) << by_columns.error().message;
  EXPECT_NEAR(by_columns->front().cloud.positions[0].x(), 2.0, 1e-6);
}

TEST(DepthImage, OfARealCameraIsThePointCloudThatItsPublisherMadeOfIt) {
  if (!std::filesystem::exists(kBunny)) GTEST_SKIP() << kBunny << " is not there";
  const auto depth = read_scans(kBunny / "depth" / "depth_00.png", Unit::stated);
  const auto cloud = read_scans(kBunny / "scans" / "scan_00.ply", Unit::metre);
  ASSERT_TRUE(depth) << depth.error().message;
  ASSERT_TRUE(cloud) << cloud.error().message;
  std::vector<Eigen::Vector3f> points;
  for (const Eigen::Vector3f& p : depth->front().cloud.positions) {
    if (!p.isZero()) points.push_back(p);
  }
  // The publisher's cloud comes from the same camera a frame apart: half of its depths are the image's, the others
  // differ by a step or two of 1 mm.
  std::size_t compared = 0, equal = 0, close = 0;
  for (std::size_t i = 0; i < cloud->front().cloud.size(); i += 97, ++compared) {
    const Eigen::Vector3f& wanted = cloud->front().cloud.positions[i];
    float nearest = 1e9f;
    for (const Eigen::Vector3f& p : points) nearest = std::min(nearest, (p - wanted).norm());
    equal += nearest < 0.02f ? 1 : 0;
    close += nearest < 2.6f ? 1 : 0;
  }
  EXPECT_GT(equal, compared * 45 / 100);
  EXPECT_GT(close, compared * 97 / 100);
}

TEST(Gzip, TextAndMeshesAreReadThroughIt) {
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("scan.xyz.gz", test::gzipped("1 2 3\n4 5 6\n")), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  EXPECT_EQ(scans->front().cloud.size(), 2u);
  EXPECT_EQ(scans->front().name, "scan");
  EXPECT_EQ(scans->front().path, folder.path() / "scan.xyz.gz");
  const auto mesh =
      read_mesh(folder.file("part.off.gz", test::gzipped("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")), Unit::inch);
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->vertices[1].x(), 25.4);
}

TEST(Gzip, DamageAndTruncationAreTold) {
  const TemporaryFolder folder;
  const std::string whole = test::gzipped("1 2 3\n4 5 6\n");
  for (std::size_t length = 2; length < whole.size(); ++length) {
    EXPECT_FALSE(read_scans(folder.file("cut.xyz.gz", whole.substr(0, length)), Unit::stated)) << length;
  }
  std::string damaged = whole;
  damaged[18] = '9';
  const auto scans = read_scans(folder.file("damaged.xyz.gz", damaged), Unit::stated);
  ASSERT_FALSE(scans);
  EXPECT_THAT(scans.error().message, HasSubstr("damaged"));
}

TEST(Columns, AsStatedByTheUser) {
  const TemporaryFolder folder;
  ReadOptions options;
  options.columns = "i,z,y,x,-,r,g,b";
  const auto path = folder.file("odd.txt", "7 3 2 1 99 10 20 30\n8 6 5 4 99 40 50 60\n");
  const auto scans = read_scans(path, options);
  ASSERT_TRUE(scans) << scans.error().message;
  EXPECT_EQ(scans->front().cloud.positions[1], Eigen::Vector3f(4, 5, 6));
  EXPECT_EQ(scans->front().intensities, (std::vector<float>{7, 8}));
  EXPECT_EQ(scans->front().colours[0], (Rgb{10, 20, 30}));
  options.columns = "x,y,z";
  EXPECT_THAT(read_scans(path, options).error().message, HasSubstr("line 1: found 8 values, --columns names 3"));
  options.columns = "x,y,q";
  EXPECT_EQ(read_scans(path, options).error().code, ErrorCode::invalid_argument);
}

TEST(Columns, OfPtsFilesAreGuessedAndTold) {
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("hall.pts", "2\n1 2 3 -500 10 20 30\n4 5 6 100 40 50 60\n"), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  EXPECT_EQ(scans->front().intensities, (std::vector<float>{-500, 100}));
  EXPECT_EQ(scans->front().colours[1], (Rgb{40, 50, 60}));
  EXPECT_THAT(scans->front().notes,
              ::testing::Contains(HasSubstr("columns 5 to 7 for the colour, column 4 for the intensity")));
}

}  // namespace
}  // namespace asbuilt::io
