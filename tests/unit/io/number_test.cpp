// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/number.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace asbuilt::io {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(ParseNumber, ReadsEverySpelling) {
  EXPECT_EQ(parse_number("1"), 1.0);
  EXPECT_EQ(parse_number("-1.5e3"), -1500.0);
  EXPECT_EQ(parse_number("+2.25"), 2.25);
  EXPECT_EQ(parse_number(".5"), 0.5);
  EXPECT_EQ(parse_number("5."), 5.0);
  EXPECT_EQ(parse_number("1E-2"), 0.01);
  EXPECT_EQ(parse_number("inf"), kInfinity);
  EXPECT_EQ(parse_number("-INF"), -kInfinity);
  EXPECT_EQ(parse_number("-1.#INF"), -kInfinity);
  for (const char* nan : {"nan", "NaN", "-nan", "-nan(ind)", "1.#QNAN", "-1.#IND"}) {
    ASSERT_TRUE(parse_number(nan)) << nan;
    EXPECT_TRUE(std::isnan(*parse_number(nan))) << nan;
  }
}

TEST(ParseNumber, TooLargeIsInfiniteAndTooSmallIsZero) {
  EXPECT_EQ(parse_number("1e999"), kInfinity);
  EXPECT_EQ(parse_number("-1e999"), -kInfinity);
  EXPECT_EQ(parse_number("1e-999"), 0.0);
  EXPECT_EQ(parse_number("1" + std::string(400, '0')), kInfinity);
  EXPECT_EQ(parse_number("0." + std::string(400, '0') + "1"), 0.0);
}

TEST(ParseNumber, RefusesWhatIsNotWhollyANumber) {
  for (const char* word : {"", "+", "-", "--1", "+-1", "1x", "0x10", "1,5", "e5", "1e", " 1"}) {
    EXPECT_FALSE(parse_number(word)) << word;
  }
}

TEST(ParseInteger, KnowsTheLimits) {
  EXPECT_EQ(parse_integer("-12"), -12);
  EXPECT_EQ(parse_integer("3.0"), 3);
  EXPECT_EQ(parse_integer("9223372036854775807"), std::numeric_limits<std::int64_t>::max());
  for (const char* word : {"", "1.5", "nan", "inf", "99999999999999999999", "1e300"}) {
    EXPECT_FALSE(parse_integer(word)) << word;
  }
}

TEST(ParseCount, TakesDigitsOnly) {
  EXPECT_EQ(parse_count("18446744073709551615"), std::numeric_limits<std::uint64_t>::max());
  for (const char* word : {"", "-1", "+1", "1.0", "18446744073709551616"}) EXPECT_FALSE(parse_count(word)) << word;
}

}  // namespace
}  // namespace asbuilt::io
