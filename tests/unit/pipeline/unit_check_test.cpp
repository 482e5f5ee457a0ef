// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/unit_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace asbuilt::pipeline {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// All that the check looks at: a square plate as the part, a grid as the scan.
model::PreparedModel plate(double edge_mm) {
  model::PreparedModel model;
  model.skin.vertices = {{0, 0, 0}, {edge_mm, 0, 0}, {edge_mm, edge_mm, 0}, {0, edge_mm, 0}};
  model.skin.triangles = {{0, 1, 2}, {0, 2, 3}};
  model.diameter = diameter(model.skin);
  return model;
}

scan::Scan grid(double edge_mm, int points_per_side) {
  scan::Scan scan;
  scan.spacing_mm = edge_mm / points_per_side;
  for (int i = 0; i <= points_per_side; ++i) {
    for (int j = 0; j <= points_per_side; ++j) {
      scan.cloud.positions.emplace_back(scan.spacing_mm * i, scan.spacing_mm * j, 0.0);
    }
  }
  return scan;
}

TEST(SizeContradiction, IsNoneForACloseUpOrAHall) {
  EXPECT_FALSE(size_contradiction(grid(30.0, 50), plate(200.0), {}).has_value());
  EXPECT_FALSE(size_contradiction(grid(2000.0, 200), plate(200.0), {}).has_value());
}

TEST(SizeContradiction, NamesTheFlagForAScanInMetres) {
  const auto reason = size_contradiction(grid(0.4, 50), plate(200.0), {});
  ASSERT_TRUE(reason.has_value());
  EXPECT_THAT(*reason, HasSubstr("--scan-unit m"));
}

TEST(SizeContradiction, NamesTheFlagForAModelInMetres) {
  const auto reason = size_contradiction(grid(400.0, 50), plate(0.2), {});
  ASSERT_TRUE(reason.has_value());
  EXPECT_THAT(*reason, HasSubstr("--unit m"));
}

TEST(SizeContradiction, LooksAtHowManyPointsCouldFallOnThePart) {
  // Half of the plate's 40 000 mm2 at one point per 400 mm2: 50 points. A little sparser is too sparse.
  EXPECT_FALSE(size_contradiction(grid(1900.0, 100), plate(200.0), {}).has_value());
  EXPECT_TRUE(size_contradiction(grid(2100.0, 100), plate(200.0), {}).has_value());
}

TEST(PlausibleFactors, BringTheScanToTheSizeOfThePart) {
  EXPECT_THAT(plausible_factors(0.4, 200.0), Contains(1000.0));
  EXPECT_THAT(plausible_factors(10.0, 200.0), Contains(25.4));
  EXPECT_THAT(plausible_factors(200.0, 200.0), Not(Contains(1000.0)));
}

}  // namespace
}  // namespace asbuilt::pipeline
