// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/inspect/tolerance.h"

namespace asbuilt::inspect {

/// Statistics of signed deviations, mm. All zero when count is.
struct DeviationStatistics {
  std::size_t count = 0;
  double min = 0, max = 0, mean = 0, mean_absolute = 0, rms = 0;
  double sigma = 0;                             ///< standard deviation about the mean
  std::optional<double> sigma_without_noise;    ///< less what the standard errors explain; where those are known
  double mean_positive = 0, mean_negative = 0;  ///< of the deviations > 0 and < 0; 0 when there are none
  double median = 0, p95 = 0, p99 = 0;          ///< p95, p99 of absolute deviations
  std::optional<double> in_tolerance, over_tolerance, under_tolerance;  ///< shares, when a tolerance is given
};

/// Quantiles are of the sorted values with linear interpolation between ranks. Values must be finite; their order does
/// not matter to the last bit.
[[nodiscard]] DeviationStatistics statistics(std::vector<double> deviations_mm,
                                             const std::optional<Tolerance>& tolerance);
/// The same for many; linear in their number.
[[nodiscard]] DeviationStatistics statistics_of_many(std::vector<float> deviations_mm,
                                                     const std::optional<Tolerance>& tolerance);

}  // namespace asbuilt::inspect
