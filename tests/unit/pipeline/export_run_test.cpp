// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/export_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "asbuilt/io/pose_file.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/segment_file.h"

namespace asbuilt::pipeline {
namespace {

/// A run of three scans, of which the first and the last were accepted; the last is far from the origin of its file.
class Export : public testing::Test {
 protected:
  Export() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_ / "segments");
    for (std::size_t i = 0; i < 3; ++i) {
      io::ScanRecord scan;
      scan.name = "scan_0" + std::to_string(i);
      scan.status = i == 1 ? io::ScanStatus::rejected : io::ScanStatus::accepted;
      Pose pose(Eigen::AngleAxisd(0.1 + static_cast<double>(i), Eigen::Vector3d::UnitZ()));
      pose.translation() = Eigen::Vector3d(1.0 / 3.0, -2, 3);
      scan.model_from_scan = pose;
      if (i == 2) scan.offset = Eigen::Vector3d(4e8, 0, 0);
      Segment segment;
      segment.cloud.positions = {{0.1F, 0.2F, 0.3F}, {1, 2, 3}, {-4, 5, 6}};
      segment.cloud.normals = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
      segment.is_part = {1, 0, 1};
      segment.colours = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
      segment.intensities = {0.5F, 1.5F, 2.5F};
      EXPECT_TRUE(write_segment(folder_ / io::segment_file(i, scan.name), segment, scan.offset));
      record_.scans.push_back(scan);
    }
  }

  // One a test: they run at the same time.
  std::filesystem::path folder_ = std::filesystem::path(testing::TempDir()) / "export_run" /
                                  testing::UnitTest::GetInstance()->current_test_info()->name();
  io::RunRecord record_;
};

TEST_F(Export, PosesComeBackExactly) {
  const auto written = export_run(folder_, record_, folder_ / "poses.csv");
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(*written, 2u);
  const auto poses = io::read_poses(folder_ / "poses.csv", io::Unit::millimetre);
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 2u);
  EXPECT_EQ((*poses)[1].scan, "scan_02");
  EXPECT_TRUE((*poses)[1].model_from_scan.isApprox(*record_.scans[2].model_from_scan, 1e-14));
}

TEST_F(Export, PartsStandInTheirScansFramesWithTheirPoses) {
  const auto written = export_run(folder_, record_, folder_ / "scans.e57");
  ASSERT_TRUE(written) << written.error().message;
  const auto scans = io::read_scans(folder_ / "scans.e57", io::Unit::stated);
  ASSERT_TRUE(scans) << scans.error().message;
  ASSERT_EQ(scans->size(), 2u);
  const io::ScanFile& far = (*scans)[1];
  EXPECT_EQ(far.title, "scan_02");
  ASSERT_EQ(far.cloud.size(), 2u);  // the margin stays behind
  EXPECT_LT((far.cloud.positions[1].cast<double>() + far.offset_mm - Eigen::Vector3d(4e8 - 4, 5, 6)).norm(), 1e-3);
  EXPECT_EQ(far.colours[1], (io::Rgb{7, 8, 9}));
  EXPECT_EQ(far.intensities[1], 2.5F);
  EXPECT_EQ(far.cloud.normals[1], Eigen::Vector3f(1, 0, 0));
  EXPECT_TRUE(far.file_from_scan->isApprox(*record_.scans[2].model_from_scan, 1e-12));
}

TEST_F(Export, RefusesWhatItCannotDoAndSaysSo) {
  EXPECT_EQ(export_run(folder_, record_, folder_ / "scans.xyz").error().code, ErrorCode::invalid_argument);
  for (io::ScanRecord& scan : record_.scans) scan.status = io::ScanStatus::rejected;
  EXPECT_EQ(export_run(folder_, record_, folder_ / "poses.csv").error().code, ErrorCode::not_possible);
}

}  // namespace
}  // namespace asbuilt::pipeline
