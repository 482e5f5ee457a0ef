// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/pose_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "asbuilt/io/viewpoint_file.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using Eigen::Vector3d;
using test::TemporaryFolder;
using ::testing::HasSubstr;

class PoseFile : public ::testing::Test {
 protected:
  std::string error_of(const std::string& content) {
    const auto poses = read_poses(folder_.file("poses", content), Unit::stated);
    return poses ? "no error" : poses.error().message;
  }
  std::string viewpoint_error_of(const std::string& content) {
    const auto viewpoints = read_viewpoints(folder_.file("viewpoints.csv", content), Unit::stated);
    return viewpoints ? "no error" : viewpoints.error().message;
  }

  TemporaryFolder folder_;
};

// A quarter turn about z: x goes to y.
const std::string kTurn = "0,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1";

TEST_F(PoseFile, CsvAndJsonGiveTheSamePoses) {
  const auto csv = folder_.file(
      "p.csv", "name,a11,a12,a13,a14,a21,a22,a23,a24,a31,a32,a33,a34,a41,a42,a43,a44\n# by hand\n\"scan_01\"," + kTurn +
                   "\nscan_00,1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1\n");
  const auto json = folder_.file(
      "p.json", R"( [{"scan": "scan_01", "model_from_scan": [[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]]},)"
                R"({"scan": "scan_00", "model_from_scan": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], "note": 1}])");
  for (const auto& path : {csv, json}) {
    const auto poses = read_poses(path, Unit::metre);
    ASSERT_TRUE(poses) << poses.error().message;
    ASSERT_EQ(poses->size(), 2u);
    EXPECT_EQ(poses->at(0).scan, "scan_01");
    // Rotated by hand: (10, 0, 0) mm to (0, 10, 0), moved by (1, 2, 3) m.
    EXPECT_TRUE((poses->at(0).model_from_scan * Vector3d(10, 0, 0)).isApprox(Vector3d(1000, 2010, 3000), 1e-12));
    EXPECT_EQ(poses->at(1).scan, "scan_00");
    EXPECT_TRUE(poses->at(1).model_from_scan.isApprox(Pose::Identity(), 1e-12));
  }
}

TEST_F(PoseFile, SemicolonsMayPartDecimalCommas) {
  const auto poses = read_poses(folder_.file("p.csv", "a;1,0;0;0;0,5;0;1;0;0;0;0;1;0;0;0;0;1\n"), Unit::stated);
  ASSERT_TRUE(poses) << poses.error().message;
  EXPECT_EQ(poses->at(0).model_from_scan.translation(), Vector3d(0.5, 0, 0));
}

TEST_F(PoseFile, ErrorsNameLineOrEntry) {
  EXPECT_THAT(error_of(""), HasSubstr("the file is empty"));
  EXPECT_THAT(error_of("# nothing\n"), HasSubstr("names no scan"));
  EXPECT_THAT(error_of("a," + kTurn + "\nb,1,2,3\n"),
              HasSubstr("line 2: found 4 fields, expected 17: name,a11,a12,...,a44"));
  EXPECT_THAT(error_of("a," + kTurn + "\na," + kTurn + "\n"), HasSubstr("line 2: scan 'a' is named a second time"));
  EXPECT_THAT(error_of("a,x,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1\n"),
              HasSubstr("line 1: field 2 is 'x', expected a finite number"));
  EXPECT_THAT(error_of("a,nan,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1\n"), HasSubstr("expected a finite number"));
  EXPECT_THAT(error_of("a,2,0,0,0,0,2,0,0,0,0,2,0,0,0,0,1\n"),
              HasSubstr("line 1: the matrix is not a rigid motion (determinant 8"));
  EXPECT_THAT(error_of("a,1,0,0,0,0,1,0,0,0,0,-1,0,0,0,0,1\n"), HasSubstr("not a rigid motion (determinant -1"));
  EXPECT_THAT(error_of("a,1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,1\n"), HasSubstr("the last row is not 0 0 0 1"));
  EXPECT_THAT(error_of("[1, 2"), HasSubstr("is not valid JSON"));
  EXPECT_THAT(error_of("[1e999]"), HasSubstr("is not valid JSON"));
  EXPECT_THAT(error_of("{}"), HasSubstr("expected a JSON array"));
  EXPECT_THAT(error_of("[]"), HasSubstr("expected a JSON array"));
  EXPECT_THAT(error_of("[7]"), HasSubstr("entry 0: expected {"));
  EXPECT_THAT(error_of(R"([{"scan": "a"}])"), HasSubstr("entry 0: there is no 'model_from_scan'"));
  EXPECT_THAT(error_of(R"([{"scan": "a", "model_from_scan": [[1,2],[3,4]]}])"),
              HasSubstr("not a 4x4 array of numbers"));
  EXPECT_THAT(error_of(R"([{"scan": "a", "model_from_scan": [[1,0,0,0],[0,1,0,0],[0,0,1,"x"],[0,0,0,1]]}])"),
              HasSubstr("not a 4x4 array"));
  EXPECT_NE(error_of(std::string(100'000, '[')), "no error");
  EXPECT_FALSE(read_poses(folder_.path() / "none.csv", Unit::stated));
}

TEST_F(PoseFile, ViewpointsAreReadWithTheirUnit) {
  const auto viewpoints =
      read_viewpoints(folder_.file("v.csv", "name,x,y,z\r\nscan_00, 1, 2, 3\r\nscan_01,-1,0,0.5\r\n"), Unit::metre);
  ASSERT_TRUE(viewpoints) << viewpoints.error().message;
  ASSERT_EQ(viewpoints->size(), 2u);
  EXPECT_EQ(viewpoints->at(0).scan, "scan_00");
  EXPECT_EQ(viewpoints->at(0).viewpoint_mm, Vector3d(1000, 2000, 3000));
  EXPECT_EQ(viewpoints->at(1).viewpoint_mm, Vector3d(-1000, 0, 500));
}

TEST_F(PoseFile, DamagedViewpointsNameTheLine) {
  EXPECT_THAT(viewpoint_error_of("a,1,2\n"), HasSubstr("line 1: found 3 fields, expected 4: name,x,y,z"));
  EXPECT_THAT(viewpoint_error_of("name,x,y,z\na,1,2,inf\n"), HasSubstr("line 2: field 4 is 'inf'"));
  EXPECT_THAT(viewpoint_error_of("a,1,2,3\n\na,1,2,3\n"), HasSubstr("line 3: scan 'a' is named a second time"));
  EXPECT_THAT(viewpoint_error_of(",1,2,3\n"), HasSubstr("line 1"));
  EXPECT_THAT(viewpoint_error_of("name,x,y,z\n"), HasSubstr("names no scan"));
}

}  // namespace
}  // namespace asbuilt::io
