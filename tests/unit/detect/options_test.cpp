// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/options.h"

#include <gtest/gtest.h>

#include "support/options.h"

namespace asbuilt::detect {
namespace {

TEST(DetectOptions, DefaultsAndThePublishedMethodAreValid) {
  EXPECT_TRUE(DetectOptions{}.validate().has_value());
  EXPECT_TRUE(DetectOptions{}.as_published().validate().has_value());
}

TEST(DetectOptions, AsPublishedAreThoseOfThePaper) {
  const DetectOptions published = DetectOptions{}.as_published();
  EXPECT_TRUE(published.paper_mode);
  EXPECT_GT(published.neighbour_bins, 1) << "K > 1";
  EXPECT_EQ(published.bucket_weight_exponent, 1.0) << "p(m, alpha | f) = 1 / N_b";
  EXPECT_EQ(published.peaks_per_reference, 1) << "Eq. 10 has one maximum";
  EXPECT_EQ(published.last_peaks_per_reference, 1);
  EXPECT_EQ(published.max_hypotheses, 50);
  for (const bool ours : {published.joint_visibility, published.single_votes, published.leave_out_planes,
                          published.smooth_maxima, published.visible_maxima}) {
    EXPECT_FALSE(ours);
  }
  EXPECT_GE(published.reference_points, 400);
  EXPECT_LE(published.reference_points, 1000);
}

TEST(DetectOptions, RefuseImpossibleValuesOfEveryField) { test::expect_impossible_values_refused<DetectOptions>(); }

}  // namespace
}  // namespace asbuilt::detect
