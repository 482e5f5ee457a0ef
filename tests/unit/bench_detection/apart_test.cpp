// SPDX-License-Identifier: Apache-2.0
#include "apart.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <stdexcept>
#include <string>

namespace asbuilt::bench {
namespace {

using ::testing::HasSubstr;

constexpr double kSeconds = 20.0;

TEST(RunApart, GivesBackWhatTheWorkGivesHoweverLong) {
  EXPECT_EQ(run_apart(kSeconds, [] { return std::string(); }).value(), "");
  const std::string long_one(1'000'000, 'x');  // more than a pipe holds
  EXPECT_EQ(run_apart(kSeconds, [&] { return long_one; }).value(), long_one);
}

TEST(RunApart, ChangesNothingHere) {
  int here = 1;
  EXPECT_EQ(run_apart(kSeconds, [&] { return std::to_string(++here); }).value(), "2");
  EXPECT_EQ(here, 1);
}

TEST(RunApart, AnExceptionIsAnErrorWithItsText) {
  const auto result = run_apart(kSeconds, []() -> std::string { throw std::runtime_error("no such model"); });
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("no such model"));
}

TEST(RunApart, ACrashIsAnError) {
  const auto result = run_apart(kSeconds, []() -> std::string {
    std::signal(SIGSEGV, SIG_DFL);  // whatever watches this test
    raise(SIGSEGV);
    return "alive";
  });
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("crashed"));
}

TEST(RunApart, WorkWithoutAnEndIsStoppedInTime) {
  const auto begin = std::chrono::steady_clock::now();
  const auto result = run_apart(0.2, []() -> std::string {
    for (;;) pause();
  });
  EXPECT_FALSE(result);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
}

}  // namespace
}  // namespace asbuilt::bench
