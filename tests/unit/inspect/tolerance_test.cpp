// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/tolerance.h"

#include <gmock/gmock.h>

namespace asbuilt::inspect {
namespace {

using ::testing::HasSubstr;

std::string error_of(std::string_view content) {
  const auto table = tolerances_in(content, "tolerances");
  return table ? "no error" : table.error().message;
}

TEST(ToleranceFile, ReadsFacesBoxesAndAllOthersFromCsv) {
  const auto table = tolerances_in(
      "name,low,high\n# the rim\n3,-0.1,0.2\nface 7,-1,1\n*,-0.5,0.5\nrim,-0.05,0.05,10,0,5,0,20,4\n", "t");
  ASSERT_TRUE(table.has_value()) << table.error().message;
  EXPECT_EQ(table->others->low_mm, -0.5);
  ASSERT_EQ(table->rows.size(), 3U);
  EXPECT_EQ(table->rows[0].face, 3);
  EXPECT_EQ(table->rows[0].tolerance.high_mm, 0.2);
  EXPECT_EQ(table->rows[1].face, 7);
  EXPECT_EQ(table->rows[1].place, 4U);
  EXPECT_EQ(table->rows[2].name, "rim");
  EXPECT_EQ(table->rows[2].box->min(), Eigen::Vector3d(0, 0, 4));
  EXPECT_EQ(table->rows[2].box->max(), Eigen::Vector3d(10, 20, 5));
}

TEST(ToleranceFile, ReadsTheSameFromJson) {
  const auto table = tolerances_in(R"({"default": [-0.5, 0.5], "rows": [{"face": 3, "low": -0.1, "high": 0.2},
      {"name": "rim", "box": [[10, 0, 5], [0, 20, 4]], "low": -0.05, "high": 0.05}]})",
                                   "t");
  ASSERT_TRUE(table.has_value()) << table.error().message;
  EXPECT_EQ(table->others->high_mm, 0.5);
  EXPECT_EQ(table->rows[0].face, 3);
  EXPECT_EQ(table->rows[1].box->min(), Eigen::Vector3d(0, 0, 4));
}

TEST(ToleranceFile, NamesFacesAsTheCadDoes) {
  const auto table = tolerances_in("bore A,-0.1,0.2\n\"Dichtfläche; außen\",-1,1\n", "t");
  ASSERT_FALSE(table.has_value());  // semicolons part fields
  const auto csv = tolerances_in("bore A,-0.1,0.2\n\"face of <b>\",-1,1\n", "t.csv").value();
  EXPECT_EQ(csv.source, "t.csv");
  EXPECT_EQ(csv.rows[0].face_name, "bore A");
  EXPECT_FALSE(csv.rows[0].face.has_value());
  EXPECT_EQ(csv.rows[1].face_name, "face of <b>");
  const auto json = tolerances_in(R"([{"face": "Dichtfläche; \"außen\"", "low": -1, "high": 1},
      {"face": "face 7", "low": -1, "high": 1}])",
                                  "t")
                        .value();
  EXPECT_EQ(json.rows[0].face_name, "Dichtfläche; \"außen\"");
  EXPECT_EQ(json.rows[1].face, 7);  // what reads as a number is one
}

TEST(ToleranceFile, NamesTheLineOfWhatIsWrong) {
  EXPECT_THAT(error_of("3,-1,1\n4,-1\n"), HasSubstr("line 2"));
  EXPECT_THAT(error_of("3,-1,1\n4,-1\n"), HasSubstr("found 2 fields"));
  EXPECT_THAT(error_of("3,-1,1\n\n4,-1,much\n"), HasSubstr("line 3"));
  EXPECT_THAT(error_of("3,1,-1\n"), HasSubstr("LOW <= HIGH"));
  EXPECT_THAT(error_of("3,-1,1\nface 3,-2,2\n"), HasSubstr("second tolerance"));
  EXPECT_THAT(error_of("3,-1,1\n,-2,2\n"), HasSubstr("two corners"));
  EXPECT_THAT(error_of("bore,-1,1\nbore,-2,2\n"), HasSubstr("line 2: 'bore' is given a second tolerance"));
  EXPECT_THAT(error_of("3,-1,nan\n"), HasSubstr("finite"));
  EXPECT_THAT(error_of("*,-1,1\n*,-1,1\n"), HasSubstr("line 2"));
  EXPECT_THAT(error_of("# nothing\n"), HasSubstr("holds no tolerance"));
}

TEST(ToleranceFile, NamesTheLineInJsonToo) {
  EXPECT_THAT(error_of("{\"rows\": [\n {\"face\": 1, \"low\": 0, \"high\": 1},\n {\"face\": 2, \"low\": 0}]}"),
              HasSubstr("line 3"));
  EXPECT_THAT(error_of("[\n\n{\"low\": 0, \"high\": 1}]"), HasSubstr("line 3"));
  EXPECT_THAT(error_of("{\n\"rows\": [}\n"), HasSubstr("line 2"));
  EXPECT_THAT(error_of("{\"roes\": []}"), HasSubstr("\"rows\""));
}

}  // namespace
}  // namespace asbuilt::inspect
