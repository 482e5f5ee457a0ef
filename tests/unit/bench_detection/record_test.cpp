// SPDX-License-Identifier: Apache-2.0
#include "record.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace asbuilt::bench {
namespace {

CaseRecord example() {
  CaseRecord record;
  record.seed = 7;
  record.mode = "default";
  record.group = "distinct";
  record.part = "valve_body";
  record.content = "part";
  record.hidden = 0.25;
  record.status = "accepted";
  record.best = {true, true, 0.001, 0.95};
  record.right_rank = 3;
  record.detect = {0.5, 0.9};
  return record;
}

class RecordFile : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::path(::testing::TempDir()) /
            (std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()) + ".jsonl");
    std::filesystem::remove(path_);
  }
  void TearDown() override { std::filesystem::remove(path_); }

  std::filesystem::path path_;
};

TEST(CaseRecordLine, ComesBackAsItWas) {
  const auto back = record_of(to_line(example()));
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(to_line(*back), to_line(example()));
  EXPECT_EQ(back->right_rank, 3U);
  EXPECT_EQ(back->best.displacement, 0.001);
  EXPECT_FALSE(back->unverified.displacement);
}

TEST_F(RecordFile, ALineCutShortByAKillDoesNotCount) {
  ASSERT_TRUE(append(path_, example()));
  std::ofstream(path_, std::ios::app) << to_line(example()).substr(0, 40);
  const auto records = read_records(path_);
  ASSERT_TRUE(records) << records.error().message;
  EXPECT_EQ(records->size(), 1U);
}

TEST_F(RecordFile, AnUnreadableLineIsNamed) {
  std::ofstream(path_) << to_line(example()) << "\n{}\n";
  const auto records = read_records(path_);
  ASSERT_FALSE(records);
  EXPECT_NE(records.error().message.find("line 2"), std::string::npos) << records.error().message;
}

TEST_F(RecordFile, AFileThatIsNotThereHoldsNothing) { EXPECT_TRUE(read_records(path_).value().empty()); }

TEST(CaseRecord, AcceptedWithoutThePartIsWrong) {
  CaseRecord record = example();
  record.content = "larger";
  record.best.right = false;
  EXPECT_TRUE(record.wrong());
  EXPECT_FALSE(record.found());
}

}  // namespace
}  // namespace asbuilt::bench
