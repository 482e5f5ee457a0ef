// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/statistics.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace asbuilt::inspect {
namespace {

template <class Value>
double quantile(const std::vector<Value>& sorted, double share) {
  const double rank = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(rank);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(static_cast<double>(sorted[below]), static_cast<double>(sorted[above]),
                   rank - static_cast<double>(below));
}

/// Mean over those that `belongs` picks; 0 when there are none.
template <class Value, class Belongs>
double mean_of(const std::vector<Value>& values, const Belongs& belongs) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const Value each : values) {
    const auto value = static_cast<double>(each);
    if (!belongs(value)) continue;
    sum += value;
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

template <class Value>
void set_tolerance_shares(DeviationStatistics& result, const std::vector<Value>& sorted, const Tolerance& tolerance) {
  const auto below = std::ranges::lower_bound(sorted, tolerance.low_mm) - sorted.begin();
  const auto above = sorted.end() - std::ranges::upper_bound(sorted, tolerance.high_mm);
  const auto count = static_cast<double>(sorted.size());
  result.under_tolerance = static_cast<double>(below) / count;
  result.over_tolerance = static_cast<double>(above) / count;
  result.in_tolerance = static_cast<double>(static_cast<std::ptrdiff_t>(sorted.size()) - below - above) / count;
}

/// The absolute values of sorted ones, sorted: the two runs merged.
template <class Value>
void make_absolute(std::vector<Value>& sorted) {
  const auto first_positive = std::ranges::lower_bound(sorted, Value{0});
  std::reverse(sorted.begin(), first_positive);
  std::transform(sorted.begin(), first_positive, sorted.begin(), [](Value value) { return -value; });
  std::inplace_merge(sorted.begin(), first_positive, sorted.end());
}

// Sorted first: sums over sorted values do not depend on the order in which the points came.
template <class Value>
DeviationStatistics statistics_of_sorted(std::vector<Value>& sorted, const std::optional<Tolerance>& tolerance) {
  DeviationStatistics result;
  if (sorted.empty()) return result;
  result.count = sorted.size();
  result.min = static_cast<double>(sorted.front());
  result.max = static_cast<double>(sorted.back());
  result.mean = mean_of(sorted, [](double) { return true; });
  result.mean_positive = mean_of(sorted, [](double value) { return value > 0.0; });
  result.mean_negative = mean_of(sorted, [](double value) { return value < 0.0; });
  result.median = quantile(sorted, 0.5);

  double squares = 0.0, squares_about_mean = 0.0, absolute = 0.0;
  for (const Value each : sorted) {
    const auto value = static_cast<double>(each);
    squares += value * value;
    squares_about_mean += (value - result.mean) * (value - result.mean);
    absolute += std::abs(value);
  }
  const auto count = static_cast<double>(sorted.size());
  result.rms = std::sqrt(squares / count);
  result.sigma = std::sqrt(squares_about_mean / count);
  result.mean_absolute = absolute / count;
  if (tolerance) set_tolerance_shares(result, sorted, *tolerance);

  make_absolute(sorted);
  result.p95 = quantile(sorted, 0.95);
  result.p99 = quantile(sorted, 0.99);
  return result;
}

/// Radix sort. Bit patterns of floats order as integers once those of negative ones are turned round.
void sort(std::vector<float>& values) {
  const auto key_of = [](float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value + 0.0F);  // -0 becomes 0
    return (bits & 0x80000000U) != 0 ? ~bits : bits | 0x80000000U;
  };
  std::vector<std::uint32_t> keys(values.size()), other(values.size());
  std::ranges::transform(values, keys.begin(), key_of);
  for (int shift = 0; shift < 33; shift += 11) {
    std::array<std::size_t, 2049> starts{};
    for (const std::uint32_t key : keys) ++starts[((key >> shift) & 2047U) + 1];
    for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
    for (const std::uint32_t key : keys) other[starts[(key >> shift) & 2047U]++] = key;
    keys.swap(other);
  }
  std::ranges::transform(keys, values.begin(), [](std::uint32_t key) {
    return std::bit_cast<float>((key & 0x80000000U) != 0 ? key & 0x7fffffffU : ~key);
  });
}

}  // namespace

DeviationStatistics statistics(std::vector<double> deviations_mm, const std::optional<Tolerance>& tolerance) {
  std::ranges::sort(deviations_mm);
  return statistics_of_sorted(deviations_mm, tolerance);
}

DeviationStatistics statistics_of_many(std::vector<float> deviations_mm, const std::optional<Tolerance>& tolerance) {
  sort(deviations_mm);
  return statistics_of_sorted(deviations_mm, tolerance);
}

}  // namespace asbuilt::inspect
