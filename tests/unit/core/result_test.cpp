// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/result.h"

#include <gtest/gtest.h>

namespace asbuilt {
namespace {

Result<int> half(int number) {
  if (number % 2 != 0) return fail(ErrorCode::invalid_argument, "an odd number has no half");
  return number / 2;
}

Result<int> quarter(int number) {
  ASBUILT_TRY(halved, half(number));
  ASBUILT_TRY(result, half(halved));
  return result;
}

Result<void> must_have_a_half(int number) {
  ASBUILT_CHECK(half(number));
  return {};
}

TEST(Result, TryHandsOnTheValue) { EXPECT_EQ(quarter(12).value(), 3); }

TEST(Result, TryReturnsTheFirstError) {
  const Result<int> result = quarter(6);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
  EXPECT_EQ(result.error().message, "an odd number has no half");
}

TEST(Result, CheckReturnsTheError) {
  EXPECT_TRUE(must_have_a_half(4));
  EXPECT_FALSE(must_have_a_half(5));
}

TEST(Expect, ThrowsOnlyWhenThePreconditionIsBroken) {
  const auto demand = [](bool condition) { ASBUILT_EXPECT(condition, "a true condition"); };
  EXPECT_NO_THROW(demand(true));
  EXPECT_THROW(demand(false), std::logic_error);
}

}  // namespace
}  // namespace asbuilt
