// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <string_view>

#include "asbuilt/core/result.h"

namespace asbuilt {

/// Nothing if low <= value <= high; NaN never is. Else invalid_argument, with the option by the name a user knows.
template <class Value>
[[nodiscard]] Result<void> expect_between(std::string_view name, Value value, Value low, Value high) {
  if (value >= low && value <= high) return {};
  return fail(ErrorCode::invalid_argument, fmt::format("{} is {}, expected {} to {}", name, value, low, high));
}

}  // namespace asbuilt
