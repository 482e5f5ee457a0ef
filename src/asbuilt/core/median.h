// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt {

/// The median, of an even number of values the upper of the two in the middle. Precondition: there is a value, and none
/// is NaN. Cost: O(n).
template <class Value>
[[nodiscard]] Value median_of(std::vector<Value> values) {
  ASBUILT_EXPECT(!values.empty(), "at least one value");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace asbuilt
