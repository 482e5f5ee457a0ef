// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <optional>
#include <set>

#include "asbuilt/live/session.h"
#include "live_scenes.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;

class LiveSessionTest : public test::LiveScenes {
 protected:
  [[nodiscard]] std::unique_ptr<LiveSession> open(const LiveOptions& options = {}) const {
    auto session = LiveSession::open(model(), options, output(), false, Context(2));
    EXPECT_TRUE(session.has_value()) << session.error().message;
    return session ? std::move(*session) : nullptr;
  }
};

TEST_F(LiveSessionTest, EndsWithTheBytesOfReconstructInWhateverOrderScansCame) {
  simulate_scenes(5, 21, 0.2);
  auto session = open();
  for (const int i : {3, 0, 4}) ASSERT_TRUE(session->add(put(names_[static_cast<std::size_t>(i)])).has_value());
  ASSERT_TRUE(session->refine_jointly({}).has_value());
  session.reset();  // and it goes on where it was
  session = open();
  EXPECT_EQ(session->state()->scans.size(), 3U);
  for (const int i : {2, 1}) ASSERT_TRUE(session->add(put(names_[static_cast<std::size_t>(i)])).has_value());
  const auto record = session->write_result({});
  ASSERT_TRUE(record.has_value()) << record.error().message;
  reconstruct(base_ / "reference");
  EXPECT_EQ(content(output() / "result"), content(base_ / "reference"));
}

TEST_F(LiveSessionTest, RemovalReplacementAndDuplicatesLeaveNoTrace) {
  simulate_scenes(3, 23);
  auto session = open();
  for (const std::string& name : names_) ASSERT_TRUE(session->add(put(name)).has_value());
  // A copy under a later name counts once; under an earlier name it takes over.
  ASSERT_TRUE(session->add(put(names_[0], "zz.ply")).has_value());
  EXPECT_THAT(session->state()->duplicates, testing::ElementsAre(testing::Pair("zz.ply", names_[0])));
  EXPECT_EQ(session->state()->scans.size(), 3U);
  // The original goes: the copy comes to life.
  fs::remove(watched() / names_[0]);
  ASSERT_TRUE(session->remove(names_[0]).has_value());
  EXPECT_EQ(session->state()->scans.size(), 3U);
  EXPECT_EQ(session->state()->scans.back().file, "zz.ply");
  // Replaced by another content, it leaves the name's copy to itself.
  ASSERT_TRUE(session->add(put(names_[0], "zzz.ply")).has_value());
  EXPECT_THAT(session->state()->duplicates, testing::ElementsAre(testing::Pair("zzz.ply", "zz.ply")));
  ASSERT_TRUE(session->add(put(names_[1], "zz.ply")).has_value());
  EXPECT_EQ(session->state()->scans.back().file, "zzz.ply");
  ASSERT_TRUE(session->add(put(names_[0], "zzzz.ply")).has_value());
  ASSERT_TRUE(io::write_file(watched() / "zzz.ply", "no scan").has_value());
  ASSERT_TRUE(session->add((watched() / "zzz.ply").string()).has_value());
  EXPECT_EQ(session->state()->scans.back().file, "zzzz.ply");
  for (const char* name : {"zzz.ply", "zzzz.ply"}) {
    fs::remove(watched() / name);
    ASSERT_TRUE(session->remove(name).has_value());
  }
  // Another content under a known name.
  fs::remove(watched() / "zz.ply");
  ASSERT_TRUE(session->remove("zz.ply").has_value());
  ASSERT_TRUE(session->add(put(names_[0], names_[1])).has_value());
  EXPECT_EQ(session->state()->scans.size(), 2U);
  // Taken out and let in again, over a restart.
  ASSERT_TRUE(session->take_out(names_[2]).value());
  session.reset();
  session = open();
  ASSERT_TRUE(session->add((watched() / names_[2]).string()).has_value());
  EXPECT_EQ(session->state()->scans.size(), 1U);
  EXPECT_THAT(session->state()->removed, testing::ElementsAre(names_[2]));
  ASSERT_TRUE(session->restore(names_[2]).value());
  ASSERT_TRUE(session->add((watched() / names_[2]).string()).has_value());
  ASSERT_TRUE(session->write_result({}).has_value());
  reconstruct(base_ / "reference");
  EXPECT_EQ(content(output() / "result"), content(base_ / "reference"));
}

TEST_F(LiveSessionTest, TheVerdictOnADenseScanIsToldBeforeItIsCutOutOfAllPoints) {
  simulate_scenes(2, 24, 0.0, 120000);
  LiveOptions options;
  options.pipeline.detect.search_spacing_ratio = 0.2;  // so that these count as dense
  auto session = open(options);
  int provisional = 0;
  session->on_change = [&](const std::shared_ptr<const LiveState>& state) {
    provisional += std::ranges::any_of(state->scans, &ScanState::provisional) ? 1 : 0;
  };
  for (const std::string& name : names_) ASSERT_TRUE(session->add(put(name)).has_value());
  EXPECT_GE(provisional, 2);
  EXPECT_TRUE(std::ranges::none_of(session->state()->scans, &ScanState::provisional));
  ASSERT_TRUE(session->write_result({}).has_value());
  reconstruct(base_ / "reference", options.pipeline);
  EXPECT_EQ(content(output() / "result"), content(base_ / "reference"));
}

TEST_F(LiveSessionTest, WhatIsNoScanIsAnEntryThatFailedAndSaysWhy) {
  simulate_scenes(1, 25);
  auto session = open();
  const std::string whole = io::read_file(base_ / "scenes" / names_[0]).value();
  ASSERT_TRUE(io::write_file(watched() / "half.ply", whole.substr(0, 5000)).has_value());
  ASSERT_TRUE(session->add((watched() / "half.ply").string()).has_value());
  const auto state = session->state();
  ASSERT_EQ(state->scans.size(), 1U);
  EXPECT_EQ(state->scans[0].record.status, io::ScanStatus::failed);
  EXPECT_THAT(state->scans[0].sentence, testing::HasSubstr("half.ply"));
  EXPECT_EQ(state->now_level, "bad");
  // Whole at last.
  ASSERT_TRUE(session->add(put(names_[0], "half.ply")).has_value());
  EXPECT_NE(session->state()->scans[0].record.status, io::ScanStatus::failed);
}

TEST_F(LiveSessionTest, AFullDiskIsToldAndTheSessionLives) {
  simulate_scenes(1, 26);
  auto session = open();
  const std::string path = put(names_[0]);
  std::optional<test::FullDisk> full(std::in_place);
  const auto refused = session->add(path);
  full.reset();
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().code, ErrorCode::unwritable_output);
  EXPECT_TRUE(session->state()->scans.empty());
  ASSERT_TRUE(session->add(path).has_value());
  EXPECT_EQ(session->state()->scans.size(), 1U);
}

TEST_F(LiveSessionTest, AFolderOfAnotherModelIsRefused) {
  simulate_scenes(1, 27);
  auto session = open();
  ASSERT_TRUE(session->add(put(names_[0])).has_value());
  session.reset();
  const auto other = LiveSession::open((base_ / "scenes" / "as_built.ply").string(), {}, output(), false, Context(2));
  ASSERT_FALSE(other.has_value());
  EXPECT_EQ(other.error().code, ErrorCode::unwritable_output);
  EXPECT_THAT(other.error().message, testing::HasSubstr("another model"));
}

}  // namespace
}  // namespace asbuilt::live
