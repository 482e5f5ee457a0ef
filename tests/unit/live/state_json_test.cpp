// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "asbuilt/live/state.h"
#include "asbuilt/live/words.h"

namespace asbuilt::live {
namespace {

using Json = nlohmann::json;

TEST(StateJson, IsOneLineWithEveryFieldOfTheProtocol) {
  LiveState state;
  state.scans.resize(2);
  state.scans[0].record.name = "a";
  state.scans[0].piece = 0;
  state.scans[0].record.model_from_scan = Pose::Identity();
  state.links.push_back({0, 1, 0.4, true, "firm", {}});
  state.now_text = "Next: \"quoted\"\nline";
  const std::string text = to_json(state);
  EXPECT_EQ(text.find('\n'), std::string::npos) << "server-sent events end a message at a break";
  const Json json = Json::parse(text);
  for (const char* field : {"schema",
                            "revision",
                            "surface_revision",
                            "phase",
                            "busy_with",
                            "now",
                            "model",
                            "watch",
                            "output",
                            "coverage",
                            "scans",
                            "links",
                            "pieces",
                            "holes",
                            "views",
                            "sensor",
                            "unreachable_percent",
                            "refinement",
                            "notes",
                            "removed",
                            "duplicates",
                            "result"}) {
    EXPECT_TRUE(json.contains(field)) << field;
  }
  EXPECT_EQ(json["scans"][0]["model_from_scan"].size(), 16U);
  EXPECT_TRUE(json["scans"][1]["model_from_scan"].is_null());
  EXPECT_EQ(json["scans"][1]["links"][0]["to"], 0);
  EXPECT_TRUE(json["scans"][1]["component"].is_null());
  EXPECT_TRUE(json["coverage"]["coverable_percent"].is_null());
}

TEST(StateJson, WhatIsNotFiniteIsNullAndWhatIsNoTextIsReplaced) {
  LiveState state;
  state.covered_share = std::numeric_limits<double>::quiet_NaN();
  state.watch = "\xff";
  const Json json = Json::parse(to_json(state));
  EXPECT_TRUE(json["coverage"]["percent"].is_null());
  EXPECT_EQ(json["watch"], "\xEF\xBF\xBD");
}

TEST(Words, TellTheSideFromWhichOneLooks) {
  EXPECT_EQ(side_in_words({1, 0, 0}), "+x");
  EXPECT_EQ(side_in_words({0, -1, 0}), "-y");
  EXPECT_EQ(side_in_words({0, 0, 1}), "above (+z)");
  EXPECT_EQ(side_in_words({-1, 0, 1}), "-x, 45° above");
}

TEST(Words, AScanThatSlidesAlongZIsToldSo) {
  Matrix6d covariance = 1e-4 * Matrix6d::Identity();
  covariance.topLeftCorner<3, 3>() *= 1e-4;
  covariance(5, 5) = 4.0;
  const auto weak = weak_directions(covariance, Eigen::Vector3d::Zero(), 100.0, 0.1);
  ASSERT_EQ(weak.size(), 1U);
  EXPECT_FALSE(weak[0].is_rotation);
  EXPECT_NEAR(std::abs(weak[0].direction.z()), 1.0, 1e-6);
  EXPECT_NEAR(weak[0].sigma_mm, 2.0, 1e-6);
}

TEST(Words, ATurnAboutAnAxisThroughTheCentreIsATurnWhereverTheOriginIs) {
  const Eigen::Vector3d centre(1000.0, 0.0, 0.0);
  // Turning about z through the centre: as a twist about the origin it has a translation, too.
  Vector6d twist;
  twist << 0, 0, 1, -Eigen::Vector3d::UnitZ().cross(centre);
  const Matrix6d covariance = 1e-4 * twist * twist.transpose();
  const auto weak = weak_directions(covariance, centre, 100.0, 0.01);
  ASSERT_EQ(weak.size(), 1U);
  EXPECT_TRUE(weak[0].is_rotation);
  EXPECT_NEAR(std::abs(weak[0].direction.z()), 1.0, 1e-6);
}

TEST(Words, AScanWithoutThePartSaysWhatIsKnownAndNoMore) {
  LiveState state;
  state.scans.resize(1);
  state.scans[0].record.name = "scan_03";
  state.scans[0].record.status = io::ScanStatus::rejected;
  state.scans[0].record.reason_code = "no_hypothesis";
  state.newest = 0;
  set_now(state);
  EXPECT_EQ(state.now_level, "bad");
  EXPECT_NE(state.now_text.find("not found"), std::string::npos);
  EXPECT_EQ(state.now_text.find("should be in view"), std::string::npos);
}

TEST(Words, ATroubleComesBeforeAllElseUntilItIsOver) {
  LiveState state;
  set_now(state);
  EXPECT_EQ(state.now_level, "act");
  state.troubles["storing"] = {"The disk is full: a.ply waits.", "Make room."};
  set_now(state);
  EXPECT_EQ(state.now_level, "bad");
  EXPECT_EQ(state.now_headline, "The disk is full: a.ply waits.");
  EXPECT_EQ(state.now_text, "The disk is full: a.ply waits. Make room.");
  state.troubles.clear();
  set_now(state);
  EXPECT_EQ(state.now_level, "act");
  EXPECT_EQ(state.now_text, state.now_headline);
}

}  // namespace
}  // namespace asbuilt::live
