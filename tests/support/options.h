// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include "asbuilt/core/result.h"
#include "support/matchers.h"

namespace asbuilt::test {

/// No option is clamped: each field in turn takes values that cannot be meant, and is named in the refusal.
template <class Options>
void expect_impossible_values_refused() {
  int fields = 0;
  Options prototype;
  for_each_field(prototype, [&](const char*, auto&, const char*) { ++fields; });
  for (int chosen = 0; chosen < fields; ++chosen) {
    for (const double wrong : {-1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
      Options options;
      int field = 0;
      std::string name;
      bool applies = true;
      for_each_field(options, [&](const char* field_name, auto& value, const char*) {
        if (field++ != chosen) return;
        name = field_name;
        using Value = std::remove_reference_t<decltype(value)>;
        if constexpr (std::is_same_v<Value, bool>) {
          applies = false;  // neither of its values is impossible
        } else if constexpr (std::is_same_v<Value, int>) {
          applies = !std::isnan(wrong);
          if (applies) value = static_cast<int>(wrong);
        } else {
          value = wrong;
        }
      });
      if (!applies) continue;
      const auto result = options.validate();
      ASSERT_THAT(result, FailsWith(ErrorCode::invalid_argument)) << name << " = " << wrong;
      EXPECT_THAT(result.error().message, testing::StartsWith(name + " is"));
    }
  }
}

}  // namespace asbuilt::test
