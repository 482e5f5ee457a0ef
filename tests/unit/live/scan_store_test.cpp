// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/scan_store.h"

#include <gmock/gmock.h>

#include "asbuilt/io/file.h"
#include "support/matchers.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ScanStoreTest : public testing::Test {
 protected:
  ScanStoreTest() {
    fs::remove_all(folder_);
    io::RunRecord record;
    record.state = io::RunState::complete;
    record.version = "1";
    record.scans.resize(1);
    record.scans[0].name = "a";
    put("scans/a.ply/result.json", io::to_json(record));
    put("scans/a.ply/live.json", R"({"order": 3, "sensor": {"half_angle": 25, "near": 1, "far": 2, "distance": 1.5}})");
  }
  ~ScanStoreTest() override { fs::remove_all(folder_); }

  void put(const std::string& name, const std::string& content) const {
    fs::create_directories((folder_ / name).parent_path());
    ASSERT_TRUE(io::write_file(folder_ / name, content).has_value());
  }

  fs::path folder_ = fs::path(testing::TempDir()) /
                     ("asbuilt_store_" + std::string(testing::UnitTest::GetInstance()->current_test_info()->name()));
  std::vector<std::string> lost_;
};

TEST_F(ScanStoreTest, ReadsWhatWasCommitted) {
  const auto store = ScanStore::open(folder_, lost_);
  ASSERT_TRUE(store.has_value());
  EXPECT_THAT(lost_, IsEmpty());
  ASSERT_EQ(store->files().size(), 1U);
  EXPECT_EQ(store->files().at("a.ply").order, 3U);
  EXPECT_EQ(store->files().at("a.ply").limits->far_mm, 2.0);
}

TEST_F(ScanStoreTest, ASensorThatIsNoNumberIsLearntAnew) {
  for (const char* sensor :
       {R"({"half_angle": "wide", "near": 1, "far": 2, "distance": 1.5})", R"({"near": 1})", "7"}) {
    put("scans/a.ply/live.json", std::string(R"({"order": 3, "sensor": )") + sensor + "}");
    const auto store = ScanStore::open(folder_, lost_);
    ASSERT_TRUE(store.has_value());
    EXPECT_THAT(lost_, IsEmpty());
    EXPECT_FALSE(store->files().at("a.ply").limits.has_value()) << sensor;
  }
}

TEST_F(ScanStoreTest, AFileThatCannotBeReadIsTakenAwayAndNamed) {
  put("scans/a.ply/result.json", "{");
  const auto store = ScanStore::open(folder_, lost_);
  ASSERT_TRUE(store.has_value());
  EXPECT_THAT(lost_, ElementsAre(HasSubstr("a.ply")));
  EXPECT_THAT(store->files(), IsEmpty());
  EXPECT_FALSE(fs::exists(folder_ / "scans" / "a.ply"));
}

TEST_F(ScanStoreTest, ASecondProgramIsRefusedUntilTheFirstHasEnded) {
  auto first = ScanStore::open(folder_, lost_);
  ASSERT_TRUE(first.has_value());
  const auto second = ScanStore::open(folder_, lost_);
  ASSERT_THAT(second, test::FailsWith(ErrorCode::unwritable_output));
  EXPECT_THAT(second.error().message, HasSubstr("another asbuilt live"));
  first = fail(ErrorCode::cancelled, "gone");
  EXPECT_TRUE(ScanStore::open(folder_, lost_).has_value());
}

TEST_F(ScanStoreTest, ADamagedListOfWhatWasTakenOutIsAnErrorThatSaysWhatToDo) {
  for (const char* damaged : {"", "[]", R"({"removed": 3})", "{\"removed\": {\"a\": \"\xff\"}}"}) {
    put("live.json", damaged);
    const auto store = ScanStore::open(folder_, lost_);
    ASSERT_THAT(store, test::FailsWith(ErrorCode::unreadable_input)) << damaged;
    EXPECT_THAT(store.error().message, HasSubstr("delete it to take all files in"));
  }
}

}  // namespace
}  // namespace asbuilt::live
