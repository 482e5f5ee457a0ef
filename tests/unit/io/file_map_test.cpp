// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>

#include "asbuilt/io/file.h"
#include "support/matchers.h"
#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::FailsWith;
using test::TemporaryFolder;
using ::testing::HasSubstr;

constexpr std::size_t kMapped = std::size_t{65} << 20;  // files from 64 MB on are mapped

std::filesystem::path large_file(const TemporaryFolder& folder, const std::string& name, const std::string& head) {
  const auto path = folder.path() / name;
  std::ofstream(path, std::ios::binary) << head;
  std::filesystem::resize_file(path, kMapped);  // zeros, which take no room on disk
  return path;
}

TEST(FileMap, AFileCutShortWhileItIsReadIsAnErrorAndNoSignal) {
  const TemporaryFolder folder;
  const auto path = large_file(folder, "large.bin", "head");
  const auto content = FileContent::open(path);
  ASSERT_TRUE(content) << content.error().message;
  ASSERT_EQ(content->view().size(), kMapped);
  EXPECT_TRUE(content->whole());
  std::filesystem::resize_file(path, 4096);
  EXPECT_EQ(content->view().substr(0, 4), "head");
  EXPECT_EQ(content->view().back(), '\0');  // beyond the end: a SIGBUS without the guard
  EXPECT_EQ(content->view()[kMapped / 2], '\0');
  const auto whole = content->whole();
  ASSERT_THAT(whole, FailsWith(ErrorCode::unreadable_input));
  EXPECT_THAT(whole.error().message, HasSubstr("large.bin: the file was cut short"));
}

TEST(FileMap, ACutIsToldOfTheFileThatWasCutAndNoOther) {
  const TemporaryFolder folder;
  const auto path = large_file(folder, "a.bin", "a");
  const auto cut = FileContent::open(path).value();
  const auto other = FileContent::open(large_file(folder, "b.bin", "b")).value();
  std::filesystem::resize_file(path, 0);
  EXPECT_EQ(cut.view().front(), '\0');
  EXPECT_EQ(other.view().front(), 'b');
  EXPECT_EQ(other.view().back(), '\0');
  EXPECT_FALSE(cut.whole());
  EXPECT_TRUE(other.whole());
}

TEST(FileMap, PagesThatWereReleasedComeBack) {
  const TemporaryFolder folder;
  const auto content = FileContent::open(large_file(folder, "large.bin", "head")).value();
  EXPECT_EQ(content.view().substr(0, 4), "head");
  release_pages(content.view());
  EXPECT_EQ(content.view().substr(0, 4), "head");
  const std::string own(1 << 16, 'x');  // no map: must stay what it is
  release_pages(own);
  EXPECT_EQ(own, std::string(1 << 16, 'x'));
}

TEST(FileMapDeathTest, FaultsElsewhereStillEndTheProgram) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  const TemporaryFolder folder;
  EXPECT_EXIT(
      {
        const auto content = FileContent::open(large_file(folder, "large.bin", "head"));
        ::raise(SIGBUS);
        ::raise(SIGBUS);  // the first gave the signal back to whom it belongs
      },
      testing::KilledBySignal(SIGBUS), "");
}

}  // namespace
}  // namespace asbuilt::io
