// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/truth.h"

#include <gtest/gtest.h>

#include "asbuilt/io/file.h"
#include "scenario.h"
#include "support/matchers.h"

namespace asbuilt::evaluate {
namespace {

std::filesystem::path written(const std::string& name, const std::string& text) {
  const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / ("asbuilt_truth_" + name);
  EXPECT_TRUE(io::write_file(file, text).has_value());
  return file;
}

TEST(Truth, IsWhatTheSimulatorWrote) {
  const test::Scenario scenario("truth");
  const Truth truth = read_truth(scenario.folder).value();
  ASSERT_EQ(truth.scans.size(), 4U);
  EXPECT_DOUBLE_EQ(truth.noise_sigma_mm, scenario.simulation.noise_sigma_mm);
  for (std::size_t i = 0; i < 4; ++i) {
    const simulate::SimulatedScan& scan = scenario.simulation.scans[i];
    EXPECT_EQ(truth.scans[i].path, scan.name + ".ply");
    ASSERT_EQ(truth.scans[i].model_from_scan.has_value(), scan.model_from_scan.has_value());
    if (scan.model_from_scan) {
      EXPECT_THAT(*truth.scans[i].model_from_scan, test::PoseNear(*scan.model_from_scan, 1e-9, 1e-9));
    }
    EXPECT_DOUBLE_EQ(truth.scans[i].clutter, scan.clutter);
    EXPECT_EQ(read_labelled_points(truth, truth.scans[i]).value().labels, scan.labels);
  }
}

TEST(Truth, DamagedFilesAreErrorsThatNameTheField) {
  const auto message = [](const std::string& text) {
    const auto truth = read_truth(written("damaged.json", text));
    EXPECT_THAT(truth, test::FailsWith(ErrorCode::unreadable_input));
    return truth ? std::string() : truth.error().message;
  };
  using testing::HasSubstr;
  EXPECT_THAT(message("{"), HasSubstr("JSON"));
  EXPECT_THAT(message("[]"), HasSubstr("object"));
  EXPECT_THAT(message(R"({"unit": "mm"})"), HasSubstr("schema"));
  EXPECT_THAT(message(R"({"schema": 2, "unit": "mm"})"), HasSubstr("expected 1"));
  EXPECT_THAT(message(R"({"schema": 1, "unit": "m"})"), HasSubstr("expected mm"));
  const std::string head = R"({"schema": 1, "unit": "mm", "model": "m", "as_built": "a", "scans": )";
  EXPECT_THAT(message(head + "3}"), HasSubstr("scans"));
  EXPECT_THAT(message(head + R"([{"path": "s.ply"}]})"), HasSubstr("model_from_scan"));
  EXPECT_THAT(message(head + R"([{"path": "s.ply", "model_from_scan": [[1, 2], [3]]}]})"), HasSubstr("4 x 4"));
  EXPECT_THAT(message(head + R"([{"path": "s.ply", "model_from_scan":
      [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}]})"),
              HasSubstr("rigid"));
  EXPECT_THAT(read_truth("/nowhere/truth.json"), test::FailsWith(ErrorCode::unreadable_input));
}

TEST(Truth, LabelsMustMatchThePoints) {
  const test::Scenario scenario("labels");
  const Truth truth = read_truth(scenario.folder).value();
  ASSERT_TRUE(io::write_file(scenario.folder / "scan_00.labels", "12").has_value());
  const auto points = read_labelled_points(truth, truth.scans.front());
  EXPECT_THAT(points, test::FailsWith(ErrorCode::unreadable_input));
}

TEST(Truth, ReferencePosesAreInvertedAndScaled) {
  const auto file = written("pose.txt", "0 -1 0 0.1\n1 0 0 0.2\n0 0 1 0.3\n0 0 0 1\n");
  const Pose model_from_scan = read_reference_pose(file, io::Unit::metre).value();
  // x_scan = R x_model + t, so the point t of the scan is the model's origin.
  EXPECT_LT((model_from_scan * Eigen::Vector3d(100, 200, 300)).norm(), 1e-9);
  EXPECT_LT((model_from_scan * Eigen::Vector3d(100, 201, 300) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-9);
  EXPECT_THAT(read_reference_pose(written("short.txt", "1 0 0"), io::Unit::metre),
              test::FailsWith(ErrorCode::unreadable_input));
  EXPECT_THAT(read_reference_pose(written("sheared.txt", "1 1 0 0 0 1 0 0 0 0 1 0 0 0 0 1"), io::Unit::metre),
              test::FailsWith(ErrorCode::unreadable_input));
}

}  // namespace
}  // namespace asbuilt::evaluate
