// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "asbuilt/inspect/deviation.h"

namespace asbuilt::inspect {
namespace {

TEST(DeviationStatistics, AreThoseOfASmallSampleWorkedOutByHand) {
  const DeviationStatistics s = statistics({4.0, -2.0, 0.0, 1.0, -3.0}, Tolerance{-2.0, 1.0});
  EXPECT_EQ(s.count, 5U);
  EXPECT_DOUBLE_EQ(s.min, -3.0);
  EXPECT_DOUBLE_EQ(s.max, 4.0);
  EXPECT_DOUBLE_EQ(s.mean, 0.0);
  EXPECT_DOUBLE_EQ(s.mean_absolute, 2.0);
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt(30.0 / 5.0));
  EXPECT_DOUBLE_EQ(s.sigma, std::sqrt(30.0 / 5.0));
  EXPECT_DOUBLE_EQ(s.mean_positive, 2.5);
  EXPECT_DOUBLE_EQ(s.mean_negative, -2.5);
  EXPECT_DOUBLE_EQ(s.median, 0.0);
  EXPECT_DOUBLE_EQ(s.p95, 3.8);                         // |d| sorted 0 1 2 3 4, rank 3.8
  EXPECT_DOUBLE_EQ(s.in_tolerance.value(), 3.0 / 5.0);  // both ends belong to the tolerance
  EXPECT_DOUBLE_EQ(s.over_tolerance.value(), 1.0 / 5.0);
  EXPECT_DOUBLE_EQ(s.under_tolerance.value(), 1.0 / 5.0);
}

TEST(DeviationStatistics, OfNothingAreZeroAndClaimNoTolerance) {
  const DeviationStatistics s = statistics({}, Tolerance{-1.0, 1.0});
  EXPECT_EQ(s.count, 0U);
  EXPECT_EQ(s.rms, 0.0);
  EXPECT_FALSE(s.in_tolerance.has_value());
}

TEST(DeviationStatistics, OfOneValueHaveNoSpread) {
  const DeviationStatistics s = statistics({-0.5}, std::nullopt);
  EXPECT_EQ(s.mean, -0.5);
  EXPECT_EQ(s.sigma, 0.0);
  EXPECT_EQ(s.p95, 0.5);
  EXPECT_EQ(s.mean_positive, 0.0);
}

TEST(DeviationStatistics, DoNotDependOnTheOrderOfTheValues) {
  const DeviationStatistics forwards = statistics({0.1, 0.7, -0.3, 1e-9, 5.0}, std::nullopt);
  const DeviationStatistics backwards = statistics({5.0, 1e-9, -0.3, 0.7, 0.1}, std::nullopt);
  EXPECT_EQ(forwards.mean, backwards.mean);
  EXPECT_EQ(forwards.rms, backwards.rms);
  EXPECT_EQ(forwards.sigma, backwards.sigma);
}

TEST(InspectOptions, RefuseWhatMakesNoSense) {
  const auto valid = [](auto change) {
    InspectOptions options;
    change(options);
    return options.validate().has_value();
  };
  EXPECT_TRUE(valid([](InspectOptions&) {}));
  EXPECT_FALSE(valid([](InspectOptions& o) { o.max_distance_ratio = 0.0; }));
  EXPECT_FALSE(valid([](InspectOptions& o) { o.max_distance_ratio = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_FALSE(valid([](InspectOptions& o) { o.required_share = 1.5; }));
  EXPECT_FALSE(valid([](InspectOptions& o) { o.tolerance = Tolerance{1.0, -1.0}; }));
  EXPECT_FALSE(valid([](InspectOptions& o) { o.tolerance = Tolerance{std::nan(""), 1.0}; }));
}

}  // namespace
}  // namespace asbuilt::inspect
