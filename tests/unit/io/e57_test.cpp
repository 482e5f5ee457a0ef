// SPDX-License-Identifier: Apache-2.0
// Our reader against bytes that are built here by the standard, and against files that other software wrote (where they
// lie beside the checkout); our writer against our reader.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "asbuilt/io/crc32c.h"
#include "asbuilt/io/e57_writer.h"
#include "asbuilt/io/scan_file.h"
#include "unit/io/e57_bytes.h"
#include "unit/io/scans.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::E57Builder;
using test::TemporaryFolder;
using ::testing::HasSubstr;

#define SKIP_WITHOUT_FORMATS() \
  if (!std::filesystem::exists(test::kFormats)) GTEST_SKIP() << test::kFormats << " is not there"

TEST(Crc32c, GivesTheCheckValueOfItsDefinition) {
  EXPECT_EQ(crc32c("123456789"), 0xE3069283u);  // RFC 3720, B.4
  EXPECT_EQ(crc32c(std::string(32, '\0')), 0x8A9136AAu);
  EXPECT_EQ(crc32c(std::string(32, '\xff')), 0x62A8AB43u);
}

TEST(Crc32c, IsTheSameByInstructionByTablesAndBitByBit) {
  std::string bytes;
  for (int length = 0; length < 70; ++length) {
    EXPECT_EQ(crc32c(bytes), test::plain_crc32c(bytes)) << length;
    EXPECT_EQ(crc32c_by_tables(bytes), test::plain_crc32c(bytes)) << length;
    bytes += static_cast<char>(37 * length + 11);
  }
}

TEST(E57, ReadsScaledIntegersPackedBitByBitAcrossPackets) {
  // x of 5 bits from -3, in tenths of a metre; y of 1 bit; z without bits, always 7.
  const std::vector<int> raw_x{0, 31, 7, 16, 1, 30, 2}, raw_y{1, 0, 0, 1, 1, 0, 1};
  E57Builder file;
  file.add_scan(R"(<cartesianX type="ScaledInteger" minimum="-3" maximum="28" scale="0.1"/>)"
                R"(<cartesianY type="Integer" minimum="0" maximum="1"/>)"
                R"(<cartesianZ type="ScaledInteger" minimum="7" maximum="7" offset="0.5"/>)",
                raw_x.size(), {{test::packed(raw_x, 5), test::packed(raw_y, 1), ""}}, 2);
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("bits.e57", file.bytes()), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  ASSERT_EQ(scans->front().cloud.size(), raw_x.size());
  for (std::size_t i = 0; i < raw_x.size(); ++i) {
    const Eigen::Vector3f& p = scans->front().cloud.positions[i];
    EXPECT_NEAR(p.x(), 1000.0 * 0.1 * (raw_x[i] - 3), 1e-3);
    EXPECT_NEAR(p.y(), 1000.0 * raw_y[i], 1e-3);
    EXPECT_NEAR(p.z(), 7500.0, 1e-3);
  }
}

TEST(E57, InvalidPointsAreNotANumberAndKeepTheirPlaces) {
  E57Builder file;
  file.add_scan(R"(<cartesianX type="Float" precision="single"/><cartesianY type="Float"/><cartesianZ type="Float"/>)"
                R"(<cartesianInvalidState type="Integer" minimum="0" maximum="2"/>)",
                3,
                {{test::little(1.f) + test::little(2.f) + test::little(3.f),
                  test::little(4.0) + test::little(5.0) + test::little(6.0),
                  test::little(7.0) + test::little(8.0) + test::little(9.0), test::packed({0, 2, 1}, 2)}});
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("invalid.e57", file.bytes()), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  const auto& positions = scans->front().cloud.positions;
  ASSERT_EQ(positions.size(), 3u);
  EXPECT_EQ(positions[0], Eigen::Vector3f(1000, 4000, 7000));
  EXPECT_TRUE(std::isnan(positions[1].x()));
  EXPECT_TRUE(std::isnan(positions[2].x()));
}

TEST(E57, PoseViewpointNameColourAndGridComeAlong) {
  E57Builder file;
  const std::string header =
      "<name type=\"String\"><![CDATA[Station <7>]]></name><pose type=\"Structure\"><rotation type=\"Structure\">"
      "<w type=\"Float\">0.70710678118654757</w><z type=\"Float\">0.70710678118654757</z></rotation>"
      "<translation type=\"Structure\"><x type=\"Float\">1</x><y type=\"Float\">2</y></translation></pose>"
      "<colorLimits type=\"Structure\"><colorRedMaximum type=\"Integer\">65535</colorRedMaximum>"
      "<colorGreenMaximum type=\"Integer\">65535</colorGreenMaximum>"
      "<colorBlueMaximum type=\"Integer\">65535</colorBlueMaximum></colorLimits>";
  const auto shorts = [](std::vector<std::uint16_t> values) {
    std::string bytes;
    for (const std::uint16_t value : values) bytes += test::little(value);
    return bytes;
  };
  file.add_scan(
      R"(<cartesianX type="Float" precision="single"/><cartesianY type="Float" precision="single"/>)"
      R"(<cartesianZ type="Float" precision="single"/><colorRed type="Integer" minimum="0" maximum="65535"/>)"
      R"(<colorGreen type="Integer" minimum="0" maximum="65535"/>)"
      R"(<colorBlue type="Integer" minimum="0" maximum="65535"/>)"
      R"(<rowIndex type="Integer" minimum="0" maximum="65535"/>)"
      R"(<columnIndex type="Integer" minimum="0" maximum="65535"/><intensity type="Float" precision="single"/>)",
      2,
      {{test::little(1.f) + test::little(2.f), test::little(0.f) + test::little(0.f),
        test::little(0.f) + test::little(0.f), shorts({0, 65535}), shorts({257, 0}), shorts({0, 32896}), shorts({0, 3}),
        shorts({4, 9}), test::little(0.25f) + test::little(-1.5f)}},
      1, header);
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("posed.e57", file.bytes()), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  const ScanFile& scan = scans->front();
  EXPECT_EQ(scan.title, "Station <7>");
  ASSERT_TRUE(scan.file_from_scan);
  // A quarter turn about z takes x to y.
  EXPECT_TRUE((*scan.file_from_scan * Eigen::Vector3d(1000, 0, 0)).isApprox(Eigen::Vector3d(1000, 3000, 0), 1e-9));
  ASSERT_TRUE(scan.viewpoint_mm);
  EXPECT_EQ(*scan.viewpoint_mm, Eigen::Vector3d::Zero());
  EXPECT_EQ(scan.colours, (std::vector<Rgb>{{0, 1, 0}, {255, 0, 128}}));
  EXPECT_EQ(scan.intensities, (std::vector<float>{0.25f, -1.5f}));
  ASSERT_TRUE(scan.grid);
  EXPECT_EQ(scan.grid->rows, 4u);
  EXPECT_EQ(scan.grid->columns, 6u);
}

TEST(E57, OneDamagedScanDoesNotTakeTheOthersAlong) {
  E57Builder file;
  const std::string prototype = R"(<cartesianX type="Float"/><cartesianY type="Float"/><cartesianZ type="Float"/>)";
  const std::string three = test::little(1.0) + test::little(2.0) + test::little(3.0);
  file.add_scan(prototype, 3, {{three, three, three}});
  file.add_scan(prototype, 4, {{three, three, three}});  // one record too few
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("two.e57", file.bytes()), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  ASSERT_EQ(scans->size(), 1u);
  EXPECT_EQ(scans->front().name, "two_00");
  EXPECT_THAT(scans->front().notes, ::testing::Contains(HasSubstr("the points end after 3 of 4")));
}

TEST(E57, ADamagedPageIsNamed) {
  E57Builder file;
  const std::string one = test::little(1.0);
  file.add_scan(R"(<cartesianX type="Float"/><cartesianY type="Float"/><cartesianZ type="Float"/>)", 1,
                {{one, one, one}});
  std::string bytes = file.bytes();
  bytes[100] = static_cast<char>(bytes[100] ^ 1);
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("damaged.e57", bytes), Unit::stated);
  ASSERT_FALSE(scans);
  EXPECT_THAT(scans.error().message, HasSubstr("byte 0: page 0 is damaged"));
}

TEST(E57, LargeCoordinatesKeepTheirPrecision) {
  E57Builder file;
  std::string x, y, z;
  for (int i = 0; i < 5000; ++i)
    x += test::little(500000.0 + 0.001 * i), y += test::little(1.0), z += test::little(0.0);
  file.add_scan(R"(<cartesianX type="Float"/><cartesianY type="Float"/><cartesianZ type="Float"/>)", 5000, {{x, y, z}},
                10);
  const TemporaryFolder folder;
  const auto scans = read_scans(folder.file("far.e57", file.bytes()), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  const ScanFile& scan = scans->front();
  EXPECT_EQ(scan.offset_mm.y(), 0.0);
  for (std::size_t i = 0; i < 5000; i += 500) {
    EXPECT_NEAR(scan.offset_mm.x() + static_cast<double>(scan.cloud.positions[i].x()), 5e8 + static_cast<double>(i),
                1e-3);
  }
}

// Counts and places as the README beside the files tells them, or as follows from how they were made.
TEST(E57OfOtherSoftware, BunnyInDoubleAndInScaledIntegersIsTheSameCloud) {
  SKIP_WITHOUT_FORMATS();
  const auto exact = read_scans(test::kFormats / "bunnyDouble.e57", Unit::stated);
  const auto packed = read_scans(test::kFormats / "bunnyInt21.e57", Unit::stated);
  ASSERT_TRUE(exact && packed);
  ASSERT_EQ(exact->front().cloud.size(), 30571u);
  ASSERT_EQ(packed->front().cloud.size(), 30571u);
  for (std::size_t i = 0; i < 30571; ++i) {
    // A scaled integer is a micrometre wide.
    EXPECT_LT((exact->front().cloud.positions[i] - packed->front().cloud.positions[i]).norm(), 2e-3) << i;
  }
}

TEST(E57OfOtherSoftware, EveryValidFileIsReadAndEveryInvalidOneRefused) {
  SKIP_WITHOUT_FORMATS();
  const auto read = [](const char* name) { return read_scans(test::kFormats / name, Unit::stated); };
  const auto spherical = read("tiny_spherical.e57");
  ASSERT_TRUE(spherical) << spherical.error().message;
  EXPECT_EQ(spherical->front().cloud.size(), 360u);
  EXPECT_TRUE(spherical->front().viewpoint_mm);
  const auto two = read("A_moved_B.e57");
  ASSERT_TRUE(two) << two.error().message;
  ASSERT_EQ(two->size(), 2u);
  EXPECT_EQ((*two)[0].title, "B2 - Cloud");
  const auto normals = read("testWithNormals.e57");
  ASSERT_TRUE(normals) << normals.error().message;
  EXPECT_TRUE(normals->front().cloud.has_normals());
  const auto moved = read("translationWithoutRotation.e57");
  ASSERT_TRUE(moved) << moved.error().message;
  ASSERT_TRUE(moved->front().file_from_scan);
  EXPECT_TRUE(moved->front().file_from_scan->linear().isIdentity());
  EXPECT_FALSE(moved->front().file_from_scan->translation().isZero());
  const auto cube = read("ColouredCubeDouble.e57");
  ASSERT_TRUE(cube) << cube.error().message;
  EXPECT_EQ(cube->front().colours.size(), cube->front().cloud.size());
  const auto none = read("ZeroPoints.e57");
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_TRUE(none->front().cloud.empty());
  EXPECT_TRUE(read("scaled_integer_intensity.e57"));
  EXPECT_THAT(read("bad-crc.e57").error().message, HasSubstr("damaged"));
  EXPECT_THAT(read("empty.e57").error().message, HasSubstr("no scan"));
}

E57Scan random_scan(std::size_t count, double far_mm, unsigned seed) {
  std::srand(seed);
  E57Scan scan;
  scan.name = "station & <" + std::to_string(seed) + ">";
  for (std::size_t i = 0; i < count; ++i) {
    scan.positions_mm.push_back(Eigen::Vector3d::Random() * 3000.0 + Eigen::Vector3d(far_mm, 0, 0));
    scan.normals.push_back(Eigen::Vector3f::Random().normalized());
    scan.colours.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i / 7), 3});
    scan.intensities.push_back(static_cast<float>(i) * 0.5f);
  }
  Pose pose(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation() = Eigen::Vector3d(100, -200, 300.5);
  scan.file_from_scan = pose;
  return scan;
}

TEST(E57Writer, WhatIsWrittenIsReadBack) {
  const TemporaryFolder folder;
  std::vector<E57Scan> written{random_scan(20001, 0.0, 1), random_scan(3, 2e6, 2), random_scan(0, 0.0, 3)};
  written[1].positions_mm[1].setConstant(std::nan(""));
  const auto path = folder.path() / "round.e57";
  ASSERT_TRUE(write_e57(path, written));
  const auto read = read_scans(path, Unit::stated);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 3u);
  for (std::size_t s = 0; s < 3; ++s) {
    const ScanFile& scan = (*read)[s];
    EXPECT_EQ(scan.title, written[s].name);
    ASSERT_EQ(scan.cloud.size(), written[s].positions_mm.size());
    EXPECT_EQ(scan.colours, written[s].colours);
    EXPECT_EQ(scan.intensities, written[s].intensities);
    EXPECT_EQ(scan.cloud.normals, written[s].normals);
    EXPECT_TRUE(scan.file_from_scan->isApprox(*written[s].file_from_scan, 1e-12));
    for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
      const Eigen::Vector3d point = scan.cloud.positions[i].cast<double>() + scan.offset_mm;
      if (!written[s].positions_mm[i].allFinite()) {
        EXPECT_FALSE(point.allFinite());
      } else {
        EXPECT_LT((point - written[s].positions_mm[i]).norm(), 1e-3);
      }
    }
  }
}

}  // namespace
}  // namespace asbuilt::io
