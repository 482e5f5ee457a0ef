// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace asbuilt::bench {

struct Interval {
  double low = 0.0, high = 1.0;
};

/// The score interval of Wilson (1927) for a share: `hits` of `trials`, 95 % unless another normal quantile is given.
/// [0, 1] without trials.
[[nodiscard]] Interval wilson_interval(std::size_t hits, std::size_t trials, double quantile = 1.959963984540054);

/// The value that a share of the values do not exceed (nearest rank); 0 for none.
[[nodiscard]] double percentile(std::vector<double> values, double share);

}  // namespace asbuilt::bench
