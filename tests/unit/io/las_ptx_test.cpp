// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "asbuilt/io/scan_file.h"
#include "unit/io/las_bytes.h"
#include "unit/io/scans.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::HasSubstr;

const std::string kPtx =
    "2\n3\n10 20 30\n1 0 0\n0 1 0\n0 0 1\n"
    "0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n"
    "1 0 0 0.5 10 20 30\n2 0 0 0.25 0 0 255\n0 0 0 0.5 0 0 0\n0 0 0 0.5 0 0 0\n3 1 0 0.5 1 1 1\n4 1 2 1 1 1 1\n";

TEST(Ptx, EachScanHasItsPoseGridAndAttributes) {
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("hall.ptx", kPtx + kPtx), Unit::metre);
  ASSERT_TRUE(scans) << scans.error().message;
  ASSERT_EQ(scans->size(), 2u);
  const ScanFile& scan = (*scans)[1];
  EXPECT_EQ(scan.name, "hall_01");
  EXPECT_EQ(scan.index_in_file, 1);
  ASSERT_EQ(scan.cloud.size(), 6u);
  EXPECT_EQ(scan.cloud.positions[1], Eigen::Vector3f(2000, 0, 0));
  EXPECT_EQ(scan.cloud.positions[2],
            Eigen::Vector3f(0, 0, 0));  // no return: what to do with it is not the reader's say
  ASSERT_TRUE(scan.grid);
  EXPECT_EQ(scan.grid->columns, 2u);
  EXPECT_EQ(scan.grid->rows, 3u);
  EXPECT_EQ(scan.colours[0], (Rgb{10, 20, 30}));
  EXPECT_EQ(scan.intensities[1], 0.25f);
  // The matrix is written for row vectors: x of the scan goes along y of the file.
  ASSERT_TRUE(scan.file_from_scan);
  EXPECT_TRUE(
      (*scan.file_from_scan * Eigen::Vector3d(1000, 0, 0)).isApprox(Eigen::Vector3d(10000, 21000, 30000), 1e-9));
  ASSERT_TRUE(scan.viewpoint_mm);
  EXPECT_LT(scan.viewpoint_mm->norm(), 1e-6);
}

TEST(Ptx, PointsThatAreRegisteredAlreadyAreSeenFromTheSensorsPlace) {
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("moved.ptx",
                                            "1\n1\n10 20 30\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
                                            "11 20 30 0.5\n"),
                                Unit::metre);
  ASSERT_TRUE(scans) << scans.error().message;
  ASSERT_TRUE(scans->front().viewpoint_mm);
  EXPECT_EQ(*scans->front().viewpoint_mm, Eigen::Vector3d(10000, 20000, 30000));
}

TEST(Ptx, AnIdentitySaysNothing) {
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("plain.ptx",
                                            "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
                                            "11 20 30 0.5\n"),
                                Unit::metre);
  ASSERT_TRUE(scans) << scans.error().message;
  EXPECT_FALSE(scans->front().viewpoint_mm);
}

TEST(Ptx, WholeScansOfATruncatedFileAreKeptWithANote) {
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("cut.ptx", kPtx + kPtx.substr(0, kPtx.size() - 30)), Unit::metre);
  ASSERT_TRUE(scans) << scans.error().message;
  ASSERT_EQ(scans->size(), 1u);
  EXPECT_EQ(scans->front().name, "cut_00");
  EXPECT_THAT(scans->front().notes, Contains(HasSubstr("of 6 points")));
}

TEST(Las, ScaleOffsetIntensityAndColourAreReadInEveryPointFormat) {
  for (int format = 0; format <= 10; ++format) {
    const TemporaryFolder folder;
    const auto scans = read_scans(folder.file("points.las", test::las(format, format >= 6 ? 4 : 2)), Unit::metre);
    ASSERT_TRUE(scans) << scans.error().message;
    const ScanFile& scan = scans->front();
    ASSERT_EQ(scan.cloud.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d point = scan.cloud.positions[i].cast<double>() + scan.offset_mm;
      const auto k = static_cast<double>(i);
      EXPECT_LT((point - Eigen::Vector3d(1000 * (100 + 0.01 * k), 1000 * (-0.02 * k), 1000 * (5 + 0.001 * k))).norm(),
                1e-2);
      EXPECT_EQ(scan.intensities[i], static_cast<float>(7 * i));
    }
    const bool has_colour = format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10;
    ASSERT_EQ(!scan.colours.empty(), has_colour) << format;
    if (has_colour) {
      EXPECT_EQ(scan.colours[1], (Rgb{128, 1, 255}));
    }
  }
}

TEST(Las, RecordsThatCannotBeThereAreToldAndThePointsReadAllTheSame) {
  std::string bytes = test::las(0, 2);
  bytes.replace(100, 4, test::little(std::uint32_t{1069128089}));
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("points.las", bytes), Unit::metre);
  ASSERT_TRUE(scans) << scans.error().message;
  EXPECT_EQ(scans->front().cloud.size(), 3u);
  EXPECT_THAT(scans->front().notes, Contains(HasSubstr("1069128089 records")));
}

TEST(Las, CompressedFilesAreRefusedWithTheRemedy) {
  std::string bytes = test::las(0, 2);
  bytes[104] = static_cast<char>(0x80);
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("points.laz", bytes), Unit::metre);
  ASSERT_FALSE(scans);
  EXPECT_THAT(scans.error().message, HasSubstr("laszip"));
}

TEST(LasOfOtherSoftware, HasThePointsThatItsReadmeTells) {
  if (!std::filesystem::exists(test::kFormats)) GTEST_SKIP() << test::kFormats << " is not there";
  const auto points = [](const char* name) {
    const auto scans = read_scans(test::kFormats / name, Unit::metre);
    return scans ? static_cast<int>(scans->front().cloud.size()) : -1;
  };
  EXPECT_EQ(points("simple.las"), 1065);
  EXPECT_EQ(points("1.2-with-color.las"), 1065);
  EXPECT_EQ(points("test1_4.las"), 1000);
  EXPECT_EQ(points("gps-time-nan.las"), 1);
  EXPECT_EQ(points("no-points.las"), 0);
  const auto lying = read_scans(test::kFormats / "garbage_nVariableLength.las", Unit::metre);
  ASSERT_FALSE(lying);
  EXPECT_THAT(lying.error().message, HasSubstr("the file ends after 718 of 719 points"));
}

}  // namespace
}  // namespace asbuilt::io
