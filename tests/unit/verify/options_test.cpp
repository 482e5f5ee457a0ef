// SPDX-License-Identifier: Apache-2.0
#include "support/options.h"

#include <gtest/gtest.h>

#include "asbuilt/verify/verify.h"

namespace asbuilt::verify {
namespace {

TEST(VerifyOptions, DefaultsAreValid) { EXPECT_TRUE(VerifyOptions{}.validate().has_value()); }

TEST(VerifyOptions, RefuseImpossibleValuesOfEveryField) { test::expect_impossible_values_refused<VerifyOptions>(); }

}  // namespace
}  // namespace asbuilt::verify
