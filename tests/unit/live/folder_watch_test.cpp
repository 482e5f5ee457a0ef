// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/folder_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "support/matchers.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using Kind = FileEvent::Kind;

class Watch : public testing::Test {
 protected:
  Watch()
      : folder_(fs::path(testing::TempDir()) / "asbuilt_watch" /
                testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Watch() override { fs::remove_all(folder_); }

  void write(const std::string& file, const std::string& text = "x") const { std::ofstream(folder_ / file) << text; }

  /// The first event, however long a loaded machine takes to tell it.
  static std::vector<FileEvent> next(FolderWatch& watch) {
    for (int i = 0; i < 600; ++i) {
      if (auto events = watch.wait(100ms); !events.empty()) return events;
    }
    return {};
  }

  fs::path folder_;
};

TEST_F(Watch, TellsWhatIsThereAndWhatComes) {
  write("b.ply");
  auto watch = FolderWatch::open(folder_, 20ms).value();
  EXPECT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "b.ply"}));
  write("a.ply");
  EXPECT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "a.ply"}));
}

TEST_F(Watch, WaitsForAFileThatIsBeingWritten) {
  auto watch = FolderWatch::open(folder_, 400ms).value();
  std::ofstream stream(folder_ / "a.ply");
  for (int i = 0; i < 5; ++i) {
    stream << "more" << std::flush;
    EXPECT_THAT(watch.wait(50ms), testing::IsEmpty());
  }
  stream.close();
  EXPECT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "a.ply"}));
  EXPECT_EQ(fs::file_size(folder_ / "a.ply"), 20U);
}

TEST_F(Watch, ARenameIsOneGoneAndOneReady) {
  write("a.ply");
  auto watch = FolderWatch::open(folder_, 20ms).value();
  ASSERT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "a.ply"}));
  fs::rename(folder_ / "a.ply", folder_ / "b.ply");
  std::vector<FileEvent> all;
  while (all.size() < 2) {
    const auto more = next(watch);
    ASSERT_FALSE(more.empty());
    all.insert(all.end(), more.begin(), more.end());
  }
  EXPECT_THAT(all, testing::ElementsAre(FileEvent{Kind::gone, "a.ply"}, FileEvent{Kind::ready, "b.ply"}));
}

TEST_F(Watch, ForeignFilesAreToldOnceAndHiddenOnesNever) {
  auto watch = FolderWatch::open(folder_, 20ms).value();
  write(".a.ply.upload");
  write("notes.docx");
  EXPECT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ignored, "notes.docx"}));
  write("notes.docx", "changed");
  write("z.ply");
  EXPECT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "z.ply"}));
}

TEST_F(Watch, WhatLiesUnderItsPathIsWatchedEvenIfThatIsAnotherFolderNow) {
  fs::create_directories(folder_ / "first");
  fs::create_directories(folder_ / "second");
  fs::create_directory_symlink(folder_ / "first", folder_ / "link");
  write("first/a.ply");
  auto watch = FolderWatch::open(folder_ / "link", 20ms).value();
  ASSERT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "a.ply"}));
  fs::remove(folder_ / "link");
  fs::create_directory_symlink(folder_ / "second", folder_ / "link");
  EXPECT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::gone, "a.ply"}));
  write("second/b.ply");
  EXPECT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "b.ply"}));
}

// As a mounted disk leaves an empty folder of another disk behind when it is taken off.
TEST_F(Watch, TheEmptyFolderThatADiskLeavesBehindIsNoDeletionOfItsFiles) {
  const fs::path other = fs::path("/dev/shm") / ("asbuilt_watch_" + std::to_string(::getpid()));
  std::error_code error;
  struct stat here {
  }, there{};
  if (!fs::create_directories(other, error) || ::stat(folder_.c_str(), &here) != 0 ||
      ::stat(other.c_str(), &there) != 0 || here.st_dev == there.st_dev) {
    fs::remove_all(other, error);
    GTEST_SKIP() << "/dev/shm is no disk of its own here";
  }
  fs::create_directories(folder_ / "disk");
  write("disk/a.ply");
  fs::create_directory_symlink(folder_ / "disk", folder_ / "link");
  auto watch = FolderWatch::open(folder_ / "link", 20ms).value();
  ASSERT_THAT(next(watch), testing::ElementsAre(FileEvent{Kind::ready, "a.ply"}));
  fs::remove(folder_ / "link");
  fs::create_directory_symlink(other, folder_ / "link");
  EXPECT_THAT(watch.wait(300ms), testing::IsEmpty());
  EXPECT_TRUE(watch.is_lost());
  // The disk is back, with a file that came while it was away.
  write("disk/b.ply");
  fs::remove(folder_ / "link");
  fs::create_directory_symlink(folder_ / "disk", folder_ / "link");
  const auto events = next(watch);
  EXPECT_FALSE(watch.is_lost());
  EXPECT_THAT(events, testing::Contains(FileEvent{Kind::ready, "b.ply"}));
  EXPECT_THAT(events, testing::Not(testing::Contains(FileEvent{Kind::gone, "a.ply"})));
  fs::remove_all(other, error);
}

TEST_F(Watch, AMissingFolderIsAnErrorThatNamesIt) {
  const auto watch = FolderWatch::open(folder_ / "absent");
  ASSERT_THAT(watch, test::FailsWith(ErrorCode::unreadable_input));
  EXPECT_THAT(watch.error().message, testing::HasSubstr("absent"));
}

TEST(ScanName, IsAPlainVisibleNameWithAScansExtension) {
  for (const char* good : {"scan.ply", "Scan 07.PLY", "größe.e57", "a.xyz.gz", "depth.png"}) {
    EXPECT_TRUE(is_scan_name(good)) << good;
  }
  for (const std::string& bad :
       {std::string(""), std::string(".ply"), std::string(".a.ply"), std::string("a/b.ply"), std::string("..\\a.ply"),
        std::string("a.ply\n"), std::string("a.step"), std::string("a"), std::string("a.ply~"),
        std::string("a.ply.part"), std::string("\xff.ply"), std::string(201, 'a') + ".ply"}) {
    EXPECT_FALSE(is_scan_name(bad)) << bad;
  }
}

}  // namespace
}  // namespace asbuilt::live
