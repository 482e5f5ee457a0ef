// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <map>

#include "unit/io/temporary_folder.h"

namespace asbuilt::io {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;

std::size_t entries_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(Sha256, AgreesWithThePublishedExamples) {
  // FIPS 180-4 examples of NIST: one block, two blocks; then the empty message and a million letters.
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, PadsRightAroundTheEdgesOfABlock) {
  // Computed with the hashlib of Python for so many letters a.
  const std::map<std::size_t, std::string> known{
      {55, "9f4390f8d30c2dd92ec9f095b65e2b9ae9b0a925a5258e241c9f1e910f734318"},
      {56, "b35439a4ac6f0948b6d6f9e3c6af0f5f590ce20f1bde7090ef7970686ec6738a"},
      {63, "7d3e74a05d7db15bce4ad9ec0658ea98e3f06eeecf16b4c6fff2da457ddc2f34"},
      {64, "ffe054fe7ae0cb6dc65c3af9b61d5209f439851db43d0ba5997337df154668eb"},
      {65, "635361c48bb9eab14198e76ea8ab7f1a41685d6ad62aa9146d301d4f17eb0ae0"},
      {119, "31eba51c313a5c08226adf18d4a359cfdfd8d2e816b13f4af952f7ea6584dcfb"},
      {120, "2f3d335432c70b580af0e8e1b3674a7c020d683aa5f73aaaedfdc55af904c21c"}};
  for (const auto& [length, digest] : known) EXPECT_EQ(sha256(std::string(length, 'a')), digest) << length;
}

TEST(ReadFile, GivesEveryByte) {
  const TemporaryFolder folder;
  const std::string content("a\0b\r\n\xff", 6);
  EXPECT_EQ(read_file(folder.file("bytes", content)).value(), content);
  EXPECT_EQ(read_file(folder.file("empty", "")).value(), "");
  const std::string large(200'001, 'x');
  EXPECT_EQ(read_file(folder.file("large", large)).value(), large);
}

TEST(ReadFile, ReadsAFifoWhoseSizeNobodyKnows) {
  const TemporaryFolder folder;
  const auto path = folder.path() / "fifo";
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  const pid_t child = fork();
  if (child == 0) {
    std::ofstream(path) << std::string(100'000, 'x');
    _exit(0);
  }
  const auto content = read_file(path);
  waitpid(child, nullptr, 0);
  EXPECT_EQ(content.value().size(), 100'000u);
}

TEST(ReadFile, NamesWhatIsWrong) {
  const TemporaryFolder folder;
  const auto missing = read_file(folder.path() / "missing.ply");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::unreadable_input);
  EXPECT_THAT(missing.error().message, HasSubstr("missing.ply: there is no such file"));
  EXPECT_THAT(read_file(folder.path()).error().message, HasSubstr("is a folder"));
  EXPECT_THAT(read_file("/dev/zero").error().message, HasSubstr("is a device"));
  EXPECT_FALSE(read_file(""));
}

TEST(ReadFile, SaysWhenItMayNot) {
  const TemporaryFolder folder;
  const auto path = folder.file("secret", "x");
  chmod(path.c_str(), 0);
  chmod(folder.path().c_str(), 0755);
  const uid_t user = geteuid();
  if (user == 0 && seteuid(65534) != 0) GTEST_SKIP() << "root may read everything";
  const auto content = read_file(path);
  ASSERT_EQ(seteuid(user), 0);
  ASSERT_FALSE(content);
  EXPECT_THAT(content.error().message, HasSubstr("secret: cannot be opened: Permission denied"));
}

TEST(WriteFile, ReplacesTheWholeFileAndLeavesNothingElse) {
  const TemporaryFolder folder;
  const auto path = folder.file("out.ply", "something longer that was there before");
  ASSERT_TRUE(write_file(path, "new"));
  EXPECT_EQ(read_file(path).value(), "new");
  EXPECT_EQ(entries_in(folder.path()), 1u);
}

TEST(WriteFile, KeepsTheOldFileWhenTheDiskRefuses) {
  const TemporaryFolder folder;
  const auto path = folder.file("out.ply", "old");
  // A limit on the size of files stands in for a full disk.
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto written = write_file(path, std::string(5000, 'x'));
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);

  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::unwritable_output);
  EXPECT_EQ(read_file(path).value(), "old");
  EXPECT_EQ(entries_in(folder.path()), 1u);
}

TEST(WriteFile, RefusesFoldersDevicesAndMissingFolders) {
  const TemporaryFolder folder;
  EXPECT_THAT(write_file(folder.path(), "x").error().message, HasSubstr("there is a folder of that name"));
  EXPECT_THAT(write_file(folder.path() / "no" / "such", "x").error().message, HasSubstr("its folder does not exist"));
  EXPECT_THAT(write_file("/dev/full", "x").error().message, HasSubstr("not a regular file"));
  EXPECT_FALSE(write_file("", "x"));
  EXPECT_FALSE(write_file(folder.file("plain", "") / "below", "x"));
  EXPECT_EQ(entries_in(folder.path()), 1u);
}

}  // namespace
}  // namespace asbuilt::io
