// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/random.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

namespace asbuilt {
namespace {

TEST(Random, TheSameItemGetsTheSameNumbers) {
  Random first(3, "stage", 5), second(3, "stage", 5);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(first.bits(), second.bits());
}

TEST(Random, SeedStageAndIndexEachChangeTheNumbers) {
  std::set<std::uint64_t> first_words;
  for (const std::uint64_t seed : {0U, 1U, 2U}) {
    for (const char* stage : {"", "a", "b", "ab", "ba"}) {
      for (std::uint64_t index = 0; index < 100; ++index) first_words.insert(Random(seed, stage, index).bits());
    }
  }
  EXPECT_EQ(first_words.size(), 3U * 5U * 100U);
}

// The tolerances below are six standard errors: a correct generator fails once in 500 million.

TEST(Random, UniformHasTheMomentsOfTheUniformDistribution) {
  constexpr int kCount = 200'000;
  Random random(1, "uniform", 0);
  double sum = 0.0, sum_of_squares = 0.0;
  for (int i = 0; i < kCount; ++i) {
    const double value = random.uniform();
    ASSERT_GE(value, 0.0);
    ASSERT_LT(value, 1.0);
    sum += value;
    sum_of_squares += value * value;
  }
  EXPECT_NEAR(sum / kCount, 1.0 / 2.0, 6.0 * std::sqrt(1.0 / 12.0 / kCount));
  EXPECT_NEAR(sum_of_squares / kCount, 1.0 / 3.0, 6.0 * std::sqrt(4.0 / 45.0 / kCount));
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  constexpr int kCount = 200'000;
  Random random(1, "normal", 0);
  std::array<double, 4> moments{};
  for (int i = 0; i < kCount; ++i) {
    const double value = random.normal();
    ASSERT_TRUE(std::isfinite(value));
    double power = value;
    for (double& moment : moments) {
      moment += power / kCount;
      power *= value;
    }
  }
  EXPECT_NEAR(moments[0], 0.0, 6.0 * std::sqrt(1.0 / kCount));
  EXPECT_NEAR(moments[1], 1.0, 6.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(moments[2], 0.0, 6.0 * std::sqrt(15.0 / kCount));
  EXPECT_NEAR(moments[3], 3.0, 6.0 * std::sqrt(96.0 / kCount));
}

TEST(Random, FirstNumbersOfNeighbouringItemsAreUncorrelated) {
  constexpr int kCount = 100'000;
  double sum = 0.0, product = 0.0, previous = Random(9, "items", 0).uniform() - 0.5;
  for (std::uint64_t index = 1; index <= kCount; ++index) {
    const double value = Random(9, "items", index).uniform() - 0.5;
    sum += value;
    product += value * previous;
    previous = value;
  }
  EXPECT_NEAR(sum / kCount, 0.0, 6.0 * std::sqrt(1.0 / 12.0 / kCount));
  EXPECT_NEAR(product / kCount, 0.0, 6.0 * (1.0 / 12.0) / std::sqrt(kCount));
}

TEST(Random, BelowReachesEveryValueEquallyOften) {
  constexpr std::size_t kValues = 7;
  constexpr int kCount = 70'000;
  std::array<int, kValues> seen{};
  Random random(4, "below", 0);
  for (int i = 0; i < kCount; ++i) {
    const std::size_t value = random.below(kValues);
    ASSERT_LT(value, kValues);
    ++seen[value];
  }
  const double share = 1.0 / kValues;
  for (const int count : seen) EXPECT_NEAR(count, kCount * share, 6.0 * std::sqrt(kCount * share * (1.0 - share)));
}

TEST(Random, UniformStaysBetweenItsBounds) {
  Random random(5, "bounds", 0);
  for (int i = 0; i < 1000; ++i) {
    const double value = random.uniform(-3.0, 2.0);
    EXPECT_GE(value, -3.0);
    EXPECT_LT(value, 2.0);
  }
}

}  // namespace
}  // namespace asbuilt
