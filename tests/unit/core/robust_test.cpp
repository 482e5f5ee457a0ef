// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/robust.h"

#include <gtest/gtest.h>

namespace asbuilt {
namespace {

template <class Loss>
class RobustLoss : public testing::Test {};

using Losses = testing::Types<HuberLoss, TukeyLoss, CauchyLoss>;
TYPED_TEST_SUITE(RobustLoss, Losses);

// On both branches of each loss and for a scale other than one; r = scale itself is the border between them.
constexpr double kScale = 0.7;
constexpr double kResiduals[] = {0.05, 0.2, 0.5, 0.69, 0.71, 1.0, 3.0, 20.0};

TYPED_TEST(RobustLoss, WeightIsTheDerivativeOfTheValue) {
  const TypeParam loss{kScale};
  for (const double residual : kResiduals) {
    const double s = residual * residual, step = 1e-6 * s;
    const double numeric = (loss.value(s + step) - loss.value(s - step)) / (2.0 * step);
    EXPECT_NEAR(loss.weight(s), numeric, 1e-8) << "r = " << residual;
  }
}

TYPED_TEST(RobustLoss, IsTheSquareForSmallResiduals) {
  const TypeParam loss{kScale};
  const double s = 1e-8;
  EXPECT_NEAR(loss.value(s) / s, 1.0, 1e-6);
  EXPECT_NEAR(loss.weight(s), 1.0, 1e-6);
  EXPECT_EQ(loss.value(0.0), 0.0);
  EXPECT_EQ(loss.weight(0.0), 1.0);
}

TYPED_TEST(RobustLoss, GrowsNeverFasterThanTheSquare) {
  const TypeParam loss{kScale};
  double previous = 0.0;
  for (const double residual : kResiduals) {
    const double value = loss.value(residual * residual);
    EXPECT_GE(value, previous);
    EXPECT_LE(value, residual * residual * (1.0 + 1e-12));
    previous = value;
  }
}

TYPED_TEST(RobustLoss, HasNoStepAtItsScale) {
  const TypeParam loss{kScale};
  const double border = kScale * kScale;
  EXPECT_NEAR(loss.value(border * (1.0 - 1e-12)), loss.value(border * (1.0 + 1e-12)), 1e-11);
  EXPECT_NEAR(loss.weight(border * (1.0 - 1e-12)), loss.weight(border * (1.0 + 1e-12)), 1e-11);
}

TEST(HuberLoss, IsLinearBeyondItsScale) {
  const HuberLoss loss{2.0};
  // 2 * scale * r - scale^2, by hand for r = 5.
  EXPECT_DOUBLE_EQ(loss.value(25.0), 16.0);
}

TEST(TukeyLoss, HasNoPullBeyondItsScale) {
  const TukeyLoss loss{2.0};
  EXPECT_EQ(loss.weight(4.1), 0.0);
  EXPECT_EQ(loss.value(4.1), loss.value(1e9));
}

TEST(CauchyLoss, IsNeverQuiteDeaf) { EXPECT_GT(CauchyLoss{1.0}.weight(1e12), 0.0); }

}  // namespace
}  // namespace asbuilt
