// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/colours.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace asbuilt::report {
namespace {

/// CIE lightness of an sRGB colour, 0 to 100.
double lightness(const Rgb& rgb) {
  const auto linear = [](std::uint8_t c) {
    const double s = c / 255.0;
    return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  };
  const double y = 0.2126 * linear(rgb[0]) + 0.7152 * linear(rgb[1]) + 0.0722 * linear(rgb[2]);
  return y > 0.008856 ? 116.0 * std::cbrt(y) - 16.0 : 903.3 * y;
}

TEST(ColourMap, IsBlueBelowRedAboveAndWhiteBetween) {
  for (const auto& tolerance : {std::optional<inspect::Tolerance>(), std::optional(inspect::Tolerance{-0.3, 0.3})}) {
    const ColourMap map(1.0, tolerance);
    EXPECT_GT(map.colour(-0.8)[2], map.colour(-0.8)[0] + 60);
    EXPECT_GT(map.colour(0.8)[0], map.colour(0.8)[2] + 60);
    EXPECT_EQ(map.colour(0.0), (Rgb{247, 247, 247}));
    EXPECT_EQ(map.colour(5.0), map.colour(1.0));
    EXPECT_EQ(map.colour(-5.0), map.colour(-1.0));
    EXPECT_EQ(map.colour(std::numeric_limits<double>::quiet_NaN()), ColourMap::kNotScanned);
  }
}

TEST(ColourMap, GetsDarkerWithTheDeviationWhateverTheReaderSees) {
  for (const auto& tolerance : {std::optional<inspect::Tolerance>(), std::optional(inspect::Tolerance{-0.3, 0.2})}) {
    const ColourMap map(1.0, tolerance);
    for (const double side : {-1.0, 1.0}) {
      double before = 101.0;
      for (double d = 0.0; d <= 1.0; d += 0.02) {
        const double here = lightness(map.colour(side * d));
        EXPECT_LE(here, before + 0.5) << side * d;
        before = here;
      }
      EXPECT_LT(before, 30.0);
    }
  }
}

TEST(ColourMap, LeapsWhereTheToleranceEnds) {
  const ColourMap map(1.0, inspect::Tolerance{-0.3, 0.3});
  EXPECT_GT(lightness(map.colour(0.299)) - lightness(map.colour(0.31)), 15.0);
  EXPECT_GT(lightness(map.colour(-0.299)) - lightness(map.colour(-0.31)), 15.0);
}

TEST(ColourMap, HasStepsThatCoverTheRangeAndEndWithTheTolerance) {
  const ColourMap map(1.0, inspect::Tolerance{-0.3, 0.2});
  EXPECT_DOUBLE_EQ(map.steps().front().from_mm, -1.0);
  EXPECT_NEAR(map.steps().back().to_mm, 1.0, 1e-12);
  bool has_band = false;
  for (std::size_t i = 0; i < map.steps().size(); ++i) {
    EXPECT_NEAR(map.steps()[i].from_mm, i > 0 ? map.steps()[i - 1].to_mm : -1.0, 1e-12);
    has_band = has_band || (map.steps()[i].from_mm == -0.3 && map.steps()[i].to_mm == 0.2);
  }
  EXPECT_TRUE(has_band);
  EXPECT_EQ(map.stepped_colour(-0.29), map.stepped_colour(0.19));
  EXPECT_NE(map.stepped_colour(0.19), map.stepped_colour(0.21));
}

TEST(ColourRange, IsRoundAndFitsTheTolerance) {
  EXPECT_DOUBLE_EQ(colour_range_mm(0.37, std::nullopt), 0.4);
  EXPECT_DOUBLE_EQ(colour_range_mm(0.1, inspect::Tolerance{-1.0, 1.0}), 1.5);
  EXPECT_DOUBLE_EQ(colour_range_mm(100.0, inspect::Tolerance{-0.5, 0.5}), 2.0);
  EXPECT_DOUBLE_EQ(colour_range_mm(0.0, std::nullopt), 1.0);
}

}  // namespace
}  // namespace asbuilt::report
