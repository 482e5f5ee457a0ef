// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "asbuilt/core/random.h"
#include "asbuilt/report/image.h"
#include "asbuilt/report/strokes.h"
#include "png_decoder.h"

namespace asbuilt::report {
namespace {

TEST(Png, IsDecodedToTheSamePixels) {
  Random random(1, "png", 0);
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(7, 3), std::pair(64, 41)}) {
    Image image(width, height, {255, 255, 255});
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        // Half of it smooth, so that every filter is chosen somewhere, half noise.
        const auto noise = static_cast<std::uint8_t>(random.below(256));
        const auto smooth = static_cast<std::uint8_t>(3 * x + y);
        image.set(x, y, y % 2 == 0 ? Rgb{noise, smooth, 9} : Rgb{smooth, smooth, smooth});
      }
    }
    const test::Decoded decoded = test::decode_png(image.png());
    ASSERT_EQ(decoded.width, width);
    ASSERT_EQ(decoded.height, height);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(decoded.at(x, y)[c], image.at(x, y)[c]) << x << " " << y;
      }
    }
  }
}

int dark_pixels(const Image& image) {
  int count = 0;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) count += image.at(x, y)[0] < 128 ? 1 : 0;
  }
  return count;
}

TEST(Image, DrawsTextWithinItsWidth) {
  Image image(200, 40, {255, 255, 255});
  const double end = image.text(10.0, 30.0, 14.0, {0, 0, 0}, "deviation \u22120.5");
  EXPECT_NEAR(end, 10.0 + Image::text_width(14.0, "deviation \u22120.5"), 1e-9);
  EXPECT_GT(dark_pixels(image), 150);
  for (int y = 0; y < 40; ++y) {
    for (int x = static_cast<int>(end) + 4; x < 200; ++x) ASSERT_EQ(image.at(x, y)[0], 255);
  }
}

TEST(Image, CutsOffWhatLiesOutside) {
  Image image(20, 10, {255, 255, 255});
  image.line({-50, 5}, {70, 5}, 2.0, {0, 0, 0});
  image.fill_rectangle(15, 8, 30, 30, {0, 0, 0});
  EXPECT_EQ(image.at(10, 4)[0], 0);
  EXPECT_EQ(image.at(19, 9)[0], 0);
  EXPECT_EQ(image.at(0, 0)[0], 255);
}

TEST(Strokes, KnowEveryLetterThatLegendsUse) {
  for (const char c : std::string("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789+-.,:%()/")) {
    const Letter letter = letter_at(std::string(1, c), 0);
    const Letter unknown = letter_at("\u20ac", 0);
    EXPECT_FALSE(letter.strokes.empty()) << c;
    const bool is_box = letter.strokes.size() == 1 && letter.strokes[0].size() == unknown.strokes[0].size() &&
                        letter.strokes[0][2].y == 5.0;
    EXPECT_FALSE(is_box) << c;
  }
  EXPECT_EQ(letter_at("\u2212", 0).bytes, 3U);
}

}  // namespace
}  // namespace asbuilt::report
