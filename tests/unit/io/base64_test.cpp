// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/base64.h"

#include <gtest/gtest.h>

#include <string_view>
#include <vector>

namespace asbuilt::io {
namespace {

std::string of(std::string_view text) { return base64(std::as_bytes(std::span(text.data(), text.size()))); }

TEST(Base64, GivesTheVectorsOfRfc4648) {
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of("f"), "Zg==");
  EXPECT_EQ(of("fo"), "Zm8=");
  EXPECT_EQ(of("foo"), "Zm9v");
  EXPECT_EQ(of("foob"), "Zm9vYg==");
  EXPECT_EQ(of("fooba"), "Zm9vYmE=");
  EXPECT_EQ(of("foobar"), "Zm9vYmFy");
}

TEST(Base64, UsesTheWholeAlphabetForBytesAboveAscii) { EXPECT_EQ(of("\xfb\xff\xbf"), "+/+/"); }

TEST(PackedJson, HoldsLittleEndianValues) {
  const std::vector<std::uint16_t> shorts{1, 0x0203};  // bytes 01 00 03 02
  EXPECT_EQ(packed_json(std::span<const std::uint16_t>(shorts)), R"({"type": "u16", "count": 2, "data": "AQADAg=="})");
  const std::vector<float> floats{1.0F};  // bytes 00 00 80 3f
  EXPECT_EQ(packed_json(std::span<const float>(floats)), R"({"type": "f32", "count": 1, "data": "AACAPw=="})");
}

TEST(PackedJson, SpreadsPositionsOverTheirBox) {
  const std::vector<Eigen::Vector3d> corners{{-1, 0, 5}, {3, 2, 5}};
  EXPECT_EQ(packed_positions_json(corners),
            R"({"type": "u16", "count": 6, "min": [-1, 0, 5], "max": [3, 2, 5], "data": "AAAAAAAA/////wAA"})");
}

}  // namespace
}  // namespace asbuilt::io
