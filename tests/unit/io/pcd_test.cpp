// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/io/lzf.h"
#include "asbuilt/io/scan_file.h"
#include "unit/io/bytes.h"
#include "unit/io/scans.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using test::error_of;
using test::little;
using test::only_scan;
using test::TemporaryFolder;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string head(const std::string& fields, const std::string& sizes, const std::string& types,
                 const std::string& counts, int points, const std::string& data,
                 const std::string& viewpoint = "0 0 0 1 0 0 0") {
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS " + fields + "\nSIZE " + sizes + "\nTYPE " +
         types + "\nCOUNT " + counts + "\nWIDTH " + std::to_string(points) + "\nHEIGHT 1\nVIEWPOINT " + viewpoint +
         "\nPOINTS " + std::to_string(points) + "\nDATA " + data + "\n";
}

TEST(PcdScan, ReadsAscii) {
  const TemporaryFolder folder;
  const std::string content = head("rgb x y z normal_x normal_y normal_z histogram", "4 4 4 4 4 4 4 4",
                                   "U F F F F F F F", "1 1 1 1 1 1 1 3", 2, "ascii") +
                              "255 1 2 3 0 0 1 7 8 9\n0 nan nan nan 0 1 0 7 8 9\n";
  const ScanFile scan = only_scan(folder.file("milk.pcd", content));
  EXPECT_EQ(scan.name, "milk");
  EXPECT_EQ(scan.format, "pcd ascii");
  ASSERT_EQ(scan.cloud.size(), 2u);
  EXPECT_EQ(scan.cloud.positions[0], Vector3f(1, 2, 3));
  EXPECT_TRUE(scan.cloud.positions[1].array().isNaN().all());
  EXPECT_THAT(scan.cloud.normals, ElementsAre(Vector3f(0, 0, 1), Vector3f(0, 1, 0)));
  EXPECT_FALSE(scan.viewpoint_mm);
  EXPECT_THAT(scan.notes, IsEmpty());
}

TEST(PcdScan, ReadsBinaryFieldsOfEverySizeTypeAndCount) {
  const TemporaryFolder folder;
  std::string content = head("a y b _ x c d z", "1 8 2 1 4 4 8 2", "I F U U F I U I", "1 1 3 5 1 1 1 1", 2, "binary");
  for (const float x : {1.5f, -1.5f}) {
    content += little(std::int8_t{-1}) + little(2.25) + little(std::uint16_t{1}) + little(std::uint16_t{2}) +
               little(std::uint16_t{3}) + std::string(5, '\0') + little(x) + little(std::int32_t{9}) +
               little(std::uint64_t{1} << 40) + little(std::int16_t{-300});
  }
  const ScanFile scan = only_scan(folder.file("a.pcd", content), Unit::centimetre);
  EXPECT_EQ(scan.format, "pcd binary");
  EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(15, 22.5f, -3000), Vector3f(-15, 22.5f, -3000)));
  EXPECT_THAT(scan.notes, IsEmpty());
}

/// LZF without any repetition: runs of literals.
std::string lzf_literals(const std::string& content) {
  std::string stream;
  for (std::size_t at = 0; at < content.size(); at += 32) {
    const std::string run = content.substr(at, 32);
    stream += static_cast<char>(run.size() - 1) + run;
  }
  return stream;
}

TEST(PcdScan, ReadsCompressedFieldsOneAfterTheOther) {
  const TemporaryFolder folder;
  std::string points;
  for (const float x : {1.f, 2.f, 3.f}) points += little(x);
  points += "\1\2\3\4\5\6";
  for (const float y : {4.f, 5.f, 6.f}) points += little(y);
  for (const double z : {7., 8., 9.}) points += little(z);
  const std::string stream = lzf_literals(points);
  const std::string body =
      little(static_cast<std::uint32_t>(stream.size())) + little(static_cast<std::uint32_t>(points.size())) + stream;
  const std::string header = head("x flags y z", "4 1 4 8", "F U F F", "1 2 1 1", 3, "binary_compressed");
  const ScanFile scan = only_scan(folder.file("a.pcd", header + body));
  EXPECT_EQ(scan.format, "pcd binary_compressed");
  EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(1, 4, 7), Vector3f(2, 5, 8), Vector3f(3, 6, 9)));
  EXPECT_THAT(only_scan(folder.file("padded.pcd", header + body + std::string(100, '\0'))).notes, IsEmpty());
  EXPECT_THAT(only_scan(folder.file("more.pcd", header + body + "abc")).notes,
              ElementsAre(HasSubstr("3 bytes follow")));
}

TEST(PcdScan, TheViewpointOfTheHeaderIsWhereTheSensorStoodUnlessItIsTheDefault) {
  const TemporaryFolder folder;
  const auto with = [&](const std::string& viewpoint) {
    return only_scan(folder.file("v.pcd", head("x y z", "4 4 4", "F F F", "1 1 1", 1, "ascii", viewpoint) + "1 2 3\n"),
                     Unit::metre);
  };
  EXPECT_FALSE(with("0 0 0 1 0 0 0").viewpoint_mm);
  EXPECT_EQ(with("1 -2 0.5 0.7071 0.7071 0 0").viewpoint_mm, Vector3d(1000, -2000, 500));
  EXPECT_EQ(with("0 0 0 0.7071 0.7071 0 0").viewpoint_mm, Vector3d(0, 0, 0));
  const ScanFile broken = with("nan 0 0 1 0 0 0");
  EXPECT_FALSE(broken.viewpoint_mm);
  EXPECT_THAT(broken.notes, ElementsAre(HasSubstr("VIEWPOINT")));
}

TEST(PcdScan, OldFilesWithoutCountAndPointsAreRead) {
  const TemporaryFolder folder;
  const ScanFile scan = only_scan(
      folder.file("old.pcd", "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 1\nDATA ascii\n1 2 3\n4 5 6\n"));
  EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(1, 2, 3), Vector3f(4, 5, 6)));
}

TEST(PcdScan, ErrorsNameThePlaceAndWhatWasExpected) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& content) { return error_of(folder.file("bad.pcd", content)); };
  const std::string fields = "VERSION 0.7\nFIELDS x y z\n";
  EXPECT_THAT(message(fields), HasSubstr("bad.pcd, line 3: the file ends within the PCD header"));
  EXPECT_THAT(message(fields + "SIZE 4 4\n"), HasSubstr("line 3: SIZE has 2 values for 3 fields"));
  EXPECT_THAT(message(fields + "SIZE 4 4 3\n"), HasSubstr("SIZE of field 'z' is '3', expected 1, 2, 4 or 8"));
  EXPECT_THAT(message(fields + "TYPE F F X\n"), HasSubstr("TYPE of field 'z' is 'X'"));
  EXPECT_THAT(message(fields + "COUNT 1 1 0\n"), HasSubstr("COUNT of field 'z' is '0'"));
  EXPECT_THAT(message(fields + "SHAPE 1\n"), HasSubstr("line 3: found 'SHAPE'"));
  EXPECT_THAT(message(fields + "VIEWPOINT 0 0 0\n"), HasSubstr("VIEWPOINT has 3 values"));
  EXPECT_THAT(message(fields + "DATA ascii\n"), HasSubstr("neither POINTS nor WIDTH and HEIGHT"));
  EXPECT_THAT(message(fields + "WIDTH 2\nHEIGHT 2\nPOINTS 5\nDATA ascii\n"),
              HasSubstr("POINTS is 5, but WIDTH x HEIGHT is 2 x 2"));
  EXPECT_THAT(message(fields + "POINTS 1\nDATA text\n"), HasSubstr("DATA is 'text'"));
  EXPECT_THAT(message(fields + "SIZE 2 4 4\nPOINTS 1\nDATA ascii\n"), HasSubstr("a real of 2 bytes"));
  EXPECT_THAT(message("VERSION 0.7\nFIELDS x y\nPOINTS 1\nDATA ascii\n"), HasSubstr("no field z"));
  EXPECT_THAT(message(fields + "POINTS 0\nDATA ascii\n"), HasSubstr("0 points"));
  EXPECT_THAT(message(fields + "POINTS 2\nDATA ascii\n1 2 3\n4 5\n"),
              HasSubstr("line 6: the point has 2 values, the header declares 3"));
  EXPECT_THAT(message(fields + "POINTS 2\nDATA ascii\n1 2 3\n4 5 6 7\n"), HasSubstr("line 6: the point has more"));
  EXPECT_THAT(message(fields + "POINTS 2\nDATA ascii\n1 2 3\n"),
              HasSubstr("line 6: the file ends after 1 of 2 points"));
  EXPECT_THAT(message(fields + "POINTS 2\nDATA binary\n" + std::string(23, 'x')),
              HasSubstr("the file ends after 1 of 2 points"));
}

TEST(PcdScan, HostileSizesAreRefusedWithoutTakingMemory) {
  const TemporaryFolder folder;
  const auto message = [&](const std::string& content) { return error_of(folder.file("bad.pcd", content)); };
  const std::string fields = "FIELDS x y z\nSIZE 8 8 8\nTYPE F F F\n";
  for (const std::string points : {"1000000000000", "18446744073709551615", "768614336404564651"}) {
    for (const std::string data : {"ascii", "binary", "binary_compressed"}) {
      EXPECT_NE(message(fields + "POINTS " + points + "\nDATA " + data + "\n" + std::string(40, '\x7f')), "no error");
    }
  }
  EXPECT_NE(message(fields + "WIDTH 4294967296\nHEIGHT 4294967296\nDATA binary\n"), "no error");
  EXPECT_THAT(message(fields + "COUNT 1 1 18446744073709551615\nPOINTS 1\nDATA binary\n"), HasSubstr("COUNT"));
  // A small stream that claims to be 2.4 GB.
  EXPECT_THAT(message(fields + "POINTS 100000000\nDATA binary_compressed\n" + little(8u) + little(2'400'000'000u) +
                      std::string(8, '\1')),
              HasSubstr("8 bytes can never expand to 2400000000"));
  EXPECT_THAT(message(fields + "POINTS 2\nDATA binary_compressed\n" + little(8u) + little(24u) + std::string(8, '\1')),
              HasSubstr("24 bytes of expanded points are declared, expected 2 points of 24 bytes"));
}

TEST(Lzf, ExpandsLiteralsAndRepetitionsThatOverlap) {
  // 'a' 'b', then 4 bytes from 2 back ("abab"), then 9 + 1 bytes from 1 back by the long form, then a literal.
  const std::string stream = std::string(
                                 "\x01"
                                 "ab") +
                             '\x40' + '\x01' + std::string("\xe0\x01\x00", 3) +
                             std::string(
                                 "\x00"
                                 "c",
                                 2);
  EXPECT_EQ(lzf_expand(stream, 17), "ababab" + std::string(10, 'b') + "c");
}

TEST(Lzf, DamagedStreamsGiveNothing) {
  const std::string good = std::string(
                               "\x01"
                               "ab") +
                           '\x40' + '\x01';
  EXPECT_EQ(lzf_expand(good, 6), "ababab");
  EXPECT_FALSE(lzf_expand(good, 5));
  EXPECT_FALSE(lzf_expand(good, 7));
  for (std::size_t length = 1; length < good.size(); ++length)
    EXPECT_FALSE(lzf_expand(good.substr(0, length), 6)) << length;
  EXPECT_FALSE(lzf_expand(std::string("\x01"
                                      "ab") +
                              '\x40' + '\x02',
                          6));  // reaches back before the beginning
  EXPECT_EQ(lzf_expand("", 0), "");
}

}  // namespace
}  // namespace asbuilt::io
