// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/io/scan_file.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using Eigen::Vector3f;
using test::TemporaryFolder;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class TextScan : public ::testing::Test {
 protected:
  ScanFile read(const std::string& name, const std::string& content, Unit unit = Unit::stated) {
    auto scans = read_scans(folder_.file(name, content), unit);
    EXPECT_TRUE(scans) << (scans ? "" : scans.error().message);
    EXPECT_EQ(scans.value().size(), 1u);
    return std::move(scans.value().at(0));
  }
  std::string error_of(const std::string& content, const std::string& name = "bad.xyz") {
    const auto scans = read_scans(folder_.file(name, content), Unit::stated);
    return scans ? "no error" : scans.error().message;
  }

  TemporaryFolder folder_;
};

TEST_F(TextScan, AllSeparatorsGiveTheSamePoints) {
  const auto expected = ElementsAre(Vector3f(1.5f, -2, 3), Vector3f(4, 5, 6e3f));
  EXPECT_THAT(read("a.xyz", "1.5 -2 3\n4 5 6e3\n").cloud.positions, expected);
  EXPECT_THAT(read("a.asc", "1.5\t-2\t3\r\n4\t5\t6e3\r\n").cloud.positions, expected);
  EXPECT_THAT(read("a.txt", "  1.5   -2\t 3  \n\n4 5 6e3").cloud.positions, expected);
  EXPECT_THAT(read("a.csv", "1.5,-2,3\n4, 5, 6e3\n").cloud.positions, expected);
  EXPECT_THAT(read("b.csv", "1.5;-2;3;\n4;5;6e3;\n").cloud.positions, expected);
  EXPECT_THAT(read("c.csv", "1,5;-2,0;3\n4;5;6e3\n").cloud.positions, expected);
  EXPECT_THAT(read("d.csv",
                   "\xef\xbb\xbf"
                   "1.5,-2,3\n4,5,6e3\n")
                  .cloud.positions,
              expected);
}

TEST_F(TextScan, TheFormatIsTheExtensionAndTheUnitIsApplied) {
  const ScanFile scan = read("hall.ASC", "1 2 3\n", Unit::metre);
  EXPECT_EQ(scan.format, "asc");
  EXPECT_EQ(scan.name, "hall");
  EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(1000, 2000, 3000)));
}

TEST_F(TextScan, CommentsAndAHeaderArePassedOver) {
  const ScanFile scan = read("a.txt", "# made by hand\n// really\neast north height\n1 2 3\n# within\n4 5 6\n");
  EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(1, 2, 3), Vector3f(4, 5, 6)));
  EXPECT_THAT(scan.notes, ElementsAre(HasSubstr("columns 1 to 3 were taken for x, y, z")));
}

TEST_F(TextScan, NamesInAHeaderDecideTheColumns) {
  const ScanFile scan = read("a.csv", "id,\"Z\",\"X\",\"Y\",Ny,Nz,Nx\n7,3,1,2,0.5,0.25,1\n");
  EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(1, 2, 3)));
  EXPECT_THAT(scan.cloud.normals, ElementsAre(Vector3f(1, 0.5f, 0.25f)));
  EXPECT_THAT(scan.notes, ElementsAre(HasSubstr("by the names in the header")));
}

TEST_F(TextScan, NamesInACommentCountTooTogetherWithACountLine) {
  const ScanFile scan = read("cc.asc", "//Y X Z R G B\n2\n1 2 3 255 0 0\n4 5 6 0 255 0\n");
  EXPECT_THAT(scan.cloud.positions, ElementsAre(Vector3f(2, 1, 3), Vector3f(5, 4, 6)));
  EXPECT_FALSE(scan.cloud.has_normals());
}

TEST_F(TextScan, ColumnsOfUnitLengthAreTakenForNormalsAndColoursAreNot) {
  const ScanFile normals = read("n.xyz", "1 2 3 0 0 1\n4 5 6 0.6 0 0.8\n");
  EXPECT_THAT(normals.cloud.normals, ElementsAre(Vector3f(0, 0, 1), Vector3f(0.6f, 0, 0.8f)));
  EXPECT_THAT(normals.notes, ElementsAre(HasSubstr("columns 4 to 6 for normals")));

  const ScanFile all = read("all.pts", "1 2 3 0.5 10 20 30 0 1 0\n4 5 6 0.25 10 20 30 0 0 -1\n");
  EXPECT_THAT(all.cloud.normals, ElementsAre(Vector3f(0, 1, 0), Vector3f(0, 0, -1)));

  const ScanFile colours = read("c.xyz", "1 2 3 255 0 0\n4 5 6 0 1 0\n");
  EXPECT_FALSE(colours.cloud.has_normals());
  const ScanFile constant = read("k.xyz", "1 2 3 1 0 0\n4 5 6 1 0 0\n");
  EXPECT_FALSE(constant.cloud.has_normals());
}

TEST_F(TextScan, APtsFileOfSeveralScansGivesEachOfThem) {
  const auto scans = read_scans(folder_.file("two.pts", "2\n1 2 3 9\n4 5 6 9\n1\n7 8 9 9\n"), Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  ASSERT_EQ(scans->size(), 2u);
  EXPECT_EQ((*scans)[0].name, "two_00");
  EXPECT_EQ((*scans)[1].name, "two_01");
  EXPECT_EQ((*scans)[1].index_in_file, 1);
  EXPECT_EQ((*scans)[0].cloud.size(), 2u);
  EXPECT_THAT((*scans)[1].cloud.positions, ElementsAre(Vector3f(7, 8, 9)));
}

TEST_F(TextScan, MissingValuesAreNan) {
  const ScanFile scan = read("a.csv", "1,2,3\n4,,6\nnan,nan,nan\n");
  EXPECT_TRUE(std::isnan(scan.cloud.positions[1].y()));
  EXPECT_TRUE(scan.cloud.positions[2].array().isNaN().all());
}

TEST_F(TextScan, ALastLineWithoutItsEndIsReported) {
  EXPECT_THAT(read("a.xyz", "1 2 3\n4 5 6").notes, Contains(HasSubstr("no line end")));
  EXPECT_THAT(read("a.xyz", "1 2 3\n4 5 6\n").notes, Not(Contains(HasSubstr("no line end"))));
}

TEST_F(TextScan, ErrorsNameTheLineAndWhatWasExpected) {
  EXPECT_THAT(error_of("1 2 3\n4 5\n"), HasSubstr("bad.xyz, line 2: the point has 2 values, the first one has 3"));
  EXPECT_THAT(error_of("1 2 3\n4 5 six\n"), HasSubstr("line 2: found 'six', expected a number"));
  EXPECT_THAT(error_of("1 2\n"), HasSubstr("line 1: found 2 numbers, expected at least x y z"));
  EXPECT_THAT(error_of("# nothing\n"), HasSubstr("no line of numbers"));
  EXPECT_THAT(error_of("5\n"), HasSubstr("no line of numbers"));
  EXPECT_THAT(error_of("hello world\nand more\n"), HasSubstr("line 2: found 'and more', expected numbers"));
  EXPECT_THAT(error_of("3\n1 2 3\n4 5 6\n"), HasSubstr("line 3: a scan ends after 2 of 3 points"));
  EXPECT_THAT(error_of("1\n1 2 3\n4 5 6\n"), HasSubstr("line 3: there are more points than the 1 declared"));
  EXPECT_THAT(error_of("1 2 3\n7\n4 5 6\n"), HasSubstr("line 2: a count stands between points"));
  EXPECT_THAT(error_of("99999999999999\n1 2 3\n"), HasSubstr("after 1 of 99999999999999 points"));
  EXPECT_THAT(error_of("1,5 2,5 3,5\n"), HasSubstr("semicolon"));
  EXPECT_THAT(error_of(std::string("\xff\xfe") + std::string("1\0 \0", 4)), HasSubstr("UTF-16"));
}

}  // namespace
}  // namespace asbuilt::io
