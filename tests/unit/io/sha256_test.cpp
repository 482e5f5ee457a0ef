// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/sha256.h"

#include <gtest/gtest.h>

#include <string>

#include "asbuilt/core/random.h"

namespace asbuilt::io {
namespace {

std::string digest_of(const std::string& content, Sha256::AddBlocks add_blocks, std::size_t piece = 1000) {
  Sha256 hash(add_blocks);
  for (std::size_t begin = 0; begin < content.size(); begin += piece) {
    hash.add(std::string_view(content).substr(begin, piece));
  }
  return hash.digest();
}

/// Both ways of computing it, as far as the processor has them.
std::vector<Sha256::AddBlocks> ways() {
  std::vector<Sha256::AddBlocks> all{Sha256::add_blocks_plainly};
  if (Sha256::add_blocks_by_instructions() != nullptr) all.push_back(Sha256::add_blocks_by_instructions());
  return all;
}

// The examples of FIPS 180-2, appendix B, and of NIST for the empty message.
TEST(Sha256, GivesThePublishedDigests) {
  for (const auto way : ways()) {
    EXPECT_EQ(digest_of("", way), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    EXPECT_EQ(digest_of("abc", way), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(digest_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq", way),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    EXPECT_EQ(digest_of(std::string(1000000, 'a'), way),
              "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
  }
}

TEST(Sha256, IsTheSameByInstructionsAndPlainlyAndInAnyPieces) {
  for (std::uint64_t i = 0; i < 300; ++i) {
    Random random(1, "sha256", i);
    std::string content(random.below(700), '\0');
    for (char& c : content) c = static_cast<char>(random.below(256));
    const std::string expected = digest_of(content, Sha256::add_blocks_plainly);
    for (const auto way : ways()) EXPECT_EQ(digest_of(content, way, 1 + random.below(200)), expected) << i;
  }
}

}  // namespace
}  // namespace asbuilt::io
