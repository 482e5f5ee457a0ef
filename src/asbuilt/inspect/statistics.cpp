// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "asbuilt/inspect/deviation.h"

namespace asbuilt::inspect {
namespace {

double quantile(const std::vector<double>& sorted, double share) {
  const double rank = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], rank - static_cast<double>(below));
}

/// Mean over those that `belongs` picks; 0 when there are none.
template <class Belongs>
double mean_of(const std::vector<double>& values, const Belongs& belongs) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const double value : values) {
    if (!belongs(value)) continue;
    sum += value;
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

void set_tolerance_shares(DeviationStatistics& result, const std::vector<double>& sorted, const Tolerance& tolerance) {
  const auto below = std::ranges::lower_bound(sorted, tolerance.low_mm) - sorted.begin();
  const auto above = sorted.end() - std::ranges::upper_bound(sorted, tolerance.high_mm);
  const auto count = static_cast<double>(sorted.size());
  result.under_tolerance = static_cast<double>(below) / count;
  result.over_tolerance = static_cast<double>(above) / count;
  result.in_tolerance = static_cast<double>(static_cast<std::ptrdiff_t>(sorted.size()) - below - above) / count;
}

}  // namespace

DeviationStatistics statistics(std::vector<double> deviations_mm, const std::optional<Tolerance>& tolerance) {
  DeviationStatistics result;
  if (deviations_mm.empty()) return result;
  // Sorted first: sums over sorted values do not depend on the order in which the points came.
  std::vector<double>& sorted = deviations_mm;
  std::ranges::sort(sorted);
  result.count = sorted.size();
  result.min = sorted.front();
  result.max = sorted.back();
  result.mean = mean_of(sorted, [](double) { return true; });
  result.mean_positive = mean_of(sorted, [](double value) { return value > 0.0; });
  result.mean_negative = mean_of(sorted, [](double value) { return value < 0.0; });
  result.median = quantile(sorted, 0.5);

  double squares = 0.0, squares_about_mean = 0.0, absolute = 0.0;
  for (const double value : sorted) {
    squares += value * value;
    squares_about_mean += (value - result.mean) * (value - result.mean);
    absolute += std::abs(value);
  }
  const auto count = static_cast<double>(sorted.size());
  result.rms = std::sqrt(squares / count);
  result.sigma = std::sqrt(squares_about_mean / count);
  result.mean_absolute = absolute / count;
  if (tolerance) set_tolerance_shares(result, sorted, *tolerance);

  for (double& value : sorted) value = std::abs(value);
  std::ranges::sort(sorted);
  result.p95 = quantile(sorted, 0.95);
  result.p99 = quantile(sorted, 0.99);
  return result;
}

}  // namespace asbuilt::inspect
