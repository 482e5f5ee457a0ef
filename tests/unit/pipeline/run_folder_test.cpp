// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/run_folder.h"

#include <gtest/gtest.h>

#include <fstream>

namespace asbuilt::pipeline {
namespace {

namespace fs = std::filesystem;

class RunFolderTest : public testing::Test {
 protected:
  RunFolderTest()
      : base_(fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(base_);
    fs::create_directories(base_);
  }
  ~RunFolderTest() override { fs::remove_all(base_); }

  [[nodiscard]] fs::path out() const { return base_ / "out"; }

  static io::RunRecord record(const char* sha256 = "aa") {
    io::RunRecord record;
    record.model.sha256 = sha256;
    return record;
  }

  fs::path base_;
};

TEST_F(RunFolderTest, LeavesNothingBehindWhenARunHadNothingToSay) {
  { ASSERT_TRUE(RunFolder::open(out(), "detect", false, 1).has_value()); }
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(RunFolderTest, IsGivenBackToTheSameCommandOnly) {
  {
    auto folder = RunFolder::open(out(), "detect", false, 1);
    ASSERT_TRUE(folder->finish(record()).has_value());
  }
  EXPECT_EQ(RunFolder::open(out(), "reconstruct", false, 1).error().code, ErrorCode::unwritable_output);
  const auto again = RunFolder::open(out(), "detect", false, 1);
  ASSERT_TRUE(again.has_value());
  EXPECT_TRUE(again->earlier_run(record().model)->has_value());
  EXPECT_FALSE(again->earlier_run(record("bb").model).has_value());
}

TEST_F(RunFolderTest, ForgetsTheEarlierRunWhenForced) {
  { ASSERT_TRUE(RunFolder::open(out(), "detect", false, 1)->finish(record()).has_value()); }
  const auto forced = RunFolder::open(out(), "reconstruct", true, 1);
  ASSERT_TRUE(forced.has_value());
  EXPECT_FALSE(forced->earlier_run(record().model)->has_value());
  EXPECT_FALSE(fs::exists(out() / "result.json"));
}

TEST_F(RunFolderTest, RefusesAFolderOfSomeoneElseEvenAnEmptyOne) {
  fs::create_directory(out());
  EXPECT_EQ(RunFolder::open(out(), "detect", false, 1).error().code, ErrorCode::unwritable_output);
  EXPECT_TRUE(fs::is_empty(out()));
}

TEST_F(RunFolderTest, RefusesWhatIsNoFolder) {
  std::ofstream(out()) << "file";
  EXPECT_EQ(RunFolder::open(out(), "detect", true, 1).error().code, ErrorCode::unwritable_output);
  EXPECT_EQ(RunFolder::open(out() / "below", "detect", true, 1).error().code, ErrorCode::unwritable_output);
}

TEST_F(RunFolderTest, KeepsACheckpointWhenTheRunBreaksOff) {
  {
    auto folder = RunFolder::open(out(), "detect", false, 1);
    ASSERT_TRUE(folder->checkpoint(record(), true).has_value());
  }
  const auto again = RunFolder::open(out(), "detect", false, 1);
  EXPECT_EQ(again->earlier_run(record().model)->value().state, io::RunState::partial);
}

TEST_F(RunFolderTest, TakesAwaySegmentsThatTheRecordDoesNotKnow) {
  auto folder = RunFolder::open(out(), "detect", false, 1);
  fs::create_directory(out() / "segments");
  std::ofstream(out() / "segments" / "007_old.ply") << "x";
  ASSERT_TRUE(folder->finish(record()).has_value());
  EXPECT_FALSE(fs::exists(out() / "segments" / "007_old.ply"));
}

}  // namespace
}  // namespace asbuilt::pipeline
