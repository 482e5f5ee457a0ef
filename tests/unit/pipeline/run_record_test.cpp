// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/run_record.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace asbuilt::io {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

RunRecord example() {
  RunRecord record;
  record.version = "1.2.3";
  record.options = {{"flag", true},
                    {"count", std::int64_t{7}},
                    {"ratio", 0.1},
                    {"word", std::string("auto")},
                    {"list", std::vector<std::string>{"a", "b"}},
                    {"empty", std::vector<std::string>{}}};
  record.model = {"part \"x\".stl", "ab", 12, 100.0 / 3.0, 1e-300, "none"};
  ScanRecord scan;
  scan.path = "a b/scan.ply";
  scan.name = "scan";
  scan.points = 3'000'000'000ULL;
  scan.viewpoint = Eigen::Vector3d(0.1, -2e9, 1.0 / 3.0);
  scan.viewpoint_kind = "point";
  scan.viewpoint_source = "points";
  scan.status = ScanStatus::accepted;
  scan.model_from_scan_detected = pose_from_twist((Vector6d() << 0.1, 0.2, 0.3, 1e6 + 0.1, 2, 3).finished());
  scan.model_from_scan = scan.model_from_scan_detected;
  scan.covariance = Matrix6d::Identity() / 3.0;
  scan.component = 0;
  scan.hold_sigma = {50.0, 0.1, 1.0 / 3.0, 0.01, 0.01, 0.01};
  scan.loose_motions.resize(2);
  MotionRecord& turn = scan.loose_motions.front();
  turn.is_turn = turn.unheld = true;
  turn.through << 0.1, 2.0, 3.0;
  turn.sigma = 50.0;
  scan.score = 0.1 + 0.2;
  scan.candidates.push_back({});
  scan.candidates.push_back({});
  scan.candidates[1].facing_share = 0.3, scan.candidates[1].found_share = 0.25, scan.candidates[1].missing_share = 0.5;
  scan.candidates[1].contradiction_share = 0.25, scan.candidates[1].residual_ratio = 0.2;
  scan.candidates[1].weakest_direction = 0.01, scan.candidates[1].slip_lead = -3.5;
  scan.candidates[1].size_hold = 0.002, scan.candidates[1].size_lead = 12.5;
  scan.candidates[1].lost_end_share = 0.0625;
  scan.candidates[1].pierced_share = 0.125;
  scan.candidates[1].overrun_share = 0.125, scan.candidates[1].objection = "low_score";
  scan.instance = 2, scan.instances_in_scan = 3;
  scan.segment_points = 5;
  scan.warnings = {"one"};
  record.scans = {scan, ScanRecord{}};
  record.graph = GraphRecord{{{0, 1, 0.25, true}}, {{0, 1}}};
  record.refinement = {RefinementRecord{}};
  record.refinement->front().links = {{0, 1, {0.1, 1.0 / 3.0}, {{false, Eigen::Vector3d::UnitY(), Eigen::Vector3d::Zero(), 0.0, false}}}};
  record.deviation = DeviationRecord{0.1, 0.2, 0.3, 0.4, std::nullopt, 0.5, "fail"};
  return record;
}

TEST(RunRecord, ComesBackExactlyAsItWasWritten) {
  const std::string text = to_json(example());
  const auto back = run_record_from_json(text, "test");
  ASSERT_TRUE(back.has_value()) << back.error().message;
  EXPECT_EQ(to_json(*back), text);
  EXPECT_EQ(back->scans[0].model_from_scan->matrix(), example().scans[0].model_from_scan->matrix());
  EXPECT_EQ(back->scans[0].score, 0.1 + 0.2);
  EXPECT_EQ(back->options, example().options);
  EXPECT_EQ(back->scans[0].hold_sigma, example().scans[0].hold_sigma);
  ASSERT_EQ(back->scans[0].loose_motions.size(), 2U);
  EXPECT_TRUE(back->scans[0].loose_motions[0].is_turn && back->scans[0].loose_motions[0].unheld);
  EXPECT_EQ(back->scans[0].loose_motions[0].through, Eigen::Vector3d(0.1, 2.0, 3.0));
  EXPECT_EQ(back->refinement->front().links.at(0).held, example().refinement->front().links[0].held);
}

TEST(RunRecord, OfAnEarlierVersionIsReadWithoutTheFieldsThatCameLater) {
  std::string text = to_json(example());
  for (const char* later : {"instance", "instances_in_scan", "facing_share", "found_share", "contradiction_share",
                            "missing_share", "residual_ratio", "weakest_direction", "slip_lead", "size_hold", "size_lead", "lost_end_share", "pierced_share",
                            "overrun_share",
                            "objection", "hold_sigma", "loose_motions", "links"}) {
    const std::string key = std::string("\"") + later + "\":";
    for (auto at = text.find(key); at != std::string::npos; at = text.find(key)) text.replace(at, key.size(), "\"x\":");
  }
  const auto back = run_record_from_json(text, "test");
  ASSERT_TRUE(back.has_value()) << back.error().message;
  EXPECT_EQ(back->scans[0].instance, 1);
  EXPECT_EQ(back->scans[0].instances_in_scan, 1);
  EXPECT_TRUE(std::isnan(back->scans[0].candidates[1].found_share));
  EXPECT_TRUE(std::isnan(back->scans[0].candidates[1].slip_lead));
  EXPECT_TRUE(std::isnan(back->scans[0].candidates[1].size_lead));
  EXPECT_TRUE(std::isnan(back->scans[0].candidates[1].lost_end_share));
  EXPECT_TRUE(std::isnan(back->scans[0].candidates[1].overrun_share));
  EXPECT_EQ(back->scans[0].candidates[1].objection, "");
}

TEST(RunRecord, HasTheKeysOfTheContractInItsOrder) {
  const std::string text = to_json(example());
  std::size_t last = 0;
  for (const char* key : {"\"asbuilt\"",
                          "\"state\"",
                          "\"unit\"",
                          "\"options\"",
                          "\"model\"",
                          "\"sampling_distance\"",
                          "\"symmetry\"",
                          "\"scans\"",
                          "\"index_in_file\"",
                          "\"points\"",
                          "\"viewpoint\"",
                          "\"noise_sigma\"",
                          "\"status\"",
                          "\"reason_code\"",
                          "\"model_from_scan_detected\"",
                          "\"covariance\"",
                          "\"component\"",
                          "\"votes\"",
                          "\"free_space_violations\"",
                          "\"margin\"",
                          "\"candidates\"",
                          "\"segment_points\"",
                          "\"graph\"",
                          "\"refinement\"",
                          "\"deviation\"",
                          "\"in_tolerance\": null",
                          "\"coverage\""}) {
    const std::size_t found = text.find(key, last);
    ASSERT_NE(found, std::string::npos) << key;
    last = found;
  }
}

TEST(RunRecord, OfTheScanHalfHasNoJointPart) {
  RunRecord record = example();
  record.graph.reset();
  record.refinement.reset();
  record.deviation.reset();
  const std::string text = to_json(record);
  EXPECT_THAT(text, Not(HasSubstr("\"graph\"")));
  EXPECT_THAT(text, Not(HasSubstr("\"refinement\"")));
  EXPECT_THAT(text, Not(HasSubstr("\"deviation\"")));
}

TEST(RunRecord, WritesNullForWhatIsNoNumber) {
  RunRecord record = example();
  record.scans[0].noise_sigma = std::numeric_limits<double>::quiet_NaN();
  record.deviation->rms = std::numeric_limits<double>::infinity();
  const std::string text = to_json(record);
  EXPECT_THAT(text, HasSubstr("\"noise_sigma\": null"));
  EXPECT_THAT(text, HasSubstr("\"rms\": null"));
}

TEST(RunRecord, IsNotReadFromAnythingElse) {
  for (const char* text : {"", "{", "[]", "{}", R"({"asbuilt": {"version": "1", "schema": 2}})",
                           R"({"asbuilt": {"version": 1, "schema": 1}})"}) {
    const auto record = run_record_from_json(text, "some/result.json");
    ASSERT_FALSE(record.has_value()) << text;
    EXPECT_EQ(record.error().code, ErrorCode::unreadable_input);
    EXPECT_THAT(record.error().message, HasSubstr("some/result.json"));
  }
}

TEST(SegmentFile, KeepsHarmlessNamesAndMendsOthers) {
  EXPECT_EQ(segment_file(7, "scan_07").generic_string(), "segments/007_scan_07.ply");
  EXPECT_EQ(segment_file(1234, "../a b").generic_string(), "segments/1234_.._a_b.ply");
}

}  // namespace
}  // namespace asbuilt::io
