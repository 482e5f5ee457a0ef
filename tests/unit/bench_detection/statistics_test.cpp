// SPDX-License-Identifier: Apache-2.0
#include "statistics.h"

#include <gtest/gtest.h>

#include <cmath>

namespace asbuilt::bench {
namespace {

// R. G. Newcombe, Statistics in Medicine 17 (1998), table I, method 3.
TEST(WilsonInterval, IsThatOfNewcombesTable) {
  const struct {
    std::size_t hits, trials;
    double low, high;
  } rows[] = {{81, 263, 0.2553, 0.3662}, {15, 148, 0.0624, 0.1605}, {0, 20, 0.0, 0.1611}, {1, 29, 0.0061, 0.1718}};
  for (const auto& row : rows) {
    const Interval interval = wilson_interval(row.hits, row.trials);
    EXPECT_NEAR(interval.low, row.low, 5e-5) << row.hits << " of " << row.trials;
    EXPECT_NEAR(interval.high, row.high, 5e-5) << row.hits << " of " << row.trials;
  }
}

// The bounds are the shares p that the score test just does not reject: (hits/n - p)^2 = z^2 p (1 - p) / n.
TEST(WilsonInterval, ItsBoundsAreWhereTheScoreTestTurns) {
  const double z = 1.959963984540054;
  for (std::size_t hits = 1; hits < 37; ++hits) {
    const Interval interval = wilson_interval(hits, 37);
    for (const double bound : {interval.low, interval.high}) {
      EXPECT_NEAR(std::abs(static_cast<double>(hits) / 37.0 - bound), z * std::sqrt(bound * (1.0 - bound) / 37.0),
                  1e-12);
    }
  }
}

TEST(WilsonInterval, IsExactAtNoneAndAllAndSaysNothingWithoutTrials) {
  EXPECT_EQ(wilson_interval(0, 600).low, 0.0);
  EXPECT_EQ(wilson_interval(600, 600).high, 1.0);
  EXPECT_EQ(wilson_interval(0, 0).low, 0.0);
  EXPECT_EQ(wilson_interval(0, 0).high, 1.0);
}

TEST(Percentile, IsTheNearestRank) {
  EXPECT_EQ(percentile({}, 0.5), 0.0);
  EXPECT_EQ(percentile({3.0}, 0.95), 3.0);
  EXPECT_EQ(percentile({4.0, 1.0, 3.0, 2.0}, 0.5), 2.0);
  EXPECT_EQ(percentile({4.0, 1.0, 3.0, 2.0}, 0.95), 4.0);
}

}  // namespace
}  // namespace asbuilt::bench
