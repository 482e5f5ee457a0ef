// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/colours.h"

#include <algorithm>
#include <cmath>

namespace asbuilt::report {
namespace {

constexpr Rgb kWhite{247, 247, 247};
// From white outwards.
constexpr std::array<Rgb, 5> kBlue{{{209, 229, 240}, {146, 197, 222}, {67, 147, 195}, {33, 102, 172}, {5, 48, 97}}};
constexpr std::array<Rgb, 5> kRed{{{253, 219, 199}, {244, 165, 130}, {214, 96, 77}, {178, 24, 43}, {103, 0, 31}}};
constexpr int kSteps = 5;  // either side

Rgb mixed(const Rgb& a, const Rgb& b, double share) {
  Rgb result;
  for (std::size_t c = 0; c < 3; ++c) {
    result[c] =
        static_cast<std::uint8_t>(std::lround(std::lerp(static_cast<double>(a[c]), static_cast<double>(b[c]), share)));
  }
  return result;
}

/// The stops of one side, from zero outwards, as distances.
std::vector<ColourMap::Stop> side(const std::array<Rgb, 5>& hues, double range, double tolerance) {
  std::vector<ColourMap::Stop> stops;
  if (tolerance > 0.0 && tolerance < range) {
    stops.push_back({tolerance, hues[0]});
    const double rest = range - tolerance;
    stops.push_back({tolerance + 1e-3 * rest, mixed(hues[1], hues[2], 0.5)});
    stops.push_back({tolerance + 0.3 * rest, hues[2]});
    stops.push_back({tolerance + 0.65 * rest, hues[3]});
    stops.push_back({range, hues[4]});
    return stops;
  }
  for (std::size_t i = 0; i < hues.size(); ++i) {
    stops.push_back({range * static_cast<double>(i + 1) / static_cast<double>(hues.size()), hues[i]});
  }
  return stops;
}

}  // namespace

ColourMap::ColourMap(double range_mm, const std::optional<inspect::Tolerance>& tolerance)
    : range_mm_(range_mm > 0.0 && std::isfinite(range_mm) ? range_mm : 1.0), tolerance_(tolerance) {
  const auto below = side(kBlue, range_mm_, tolerance ? -tolerance->low_mm : 0.0);
  const auto above = side(kRed, range_mm_, tolerance ? tolerance->high_mm : 0.0);
  for (auto stop = below.rbegin(); stop != below.rend(); ++stop) stops_.push_back({-stop->value_mm, stop->rgb});
  stops_.push_back({0.0, kWhite});
  stops_.insert(stops_.end(), above.begin(), above.end());

  double step = 2.0 * range_mm_ / (2 * kSteps + 1);
  for (int i = -kSteps; i <= kSteps; ++i) {
    const double middle = i * step;
    steps_.push_back({middle - 0.5 * step, middle + 0.5 * step, colour(middle)});
  }
  if (!tolerance_ || !(tolerance_->low_mm < 0.0 && tolerance_->high_mm > 0.0) || tolerance_->high_mm >= range_mm_ ||
      -tolerance_->low_mm >= range_mm_) {
    return;
  }
  // One band for what is within tolerance, then equal steps to the range.
  steps_.clear();
  const double low = (range_mm_ + tolerance_->low_mm) / kSteps, high = (range_mm_ - tolerance_->high_mm) / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const double from = -range_mm_ + i * low;
    steps_.push_back({from, from + low, colour(from + 0.5 * low)});
  }
  steps_.push_back({tolerance_->low_mm, tolerance_->high_mm, kWhite});
  for (int i = 0; i < kSteps; ++i) {
    const double from = tolerance_->high_mm + i * high;
    steps_.push_back({from, from + high, colour(from + 0.5 * high)});
  }
}

Rgb ColourMap::colour(double deviation_mm) const {
  if (std::isnan(deviation_mm)) return kNotScanned;
  const auto above = std::ranges::upper_bound(stops_, deviation_mm, {}, &Stop::value_mm);
  if (above == stops_.begin()) return stops_.front().rgb;
  if (above == stops_.end()) return stops_.back().rgb;
  const auto below = above - 1;
  return mixed(below->rgb, above->rgb, (deviation_mm - below->value_mm) / (above->value_mm - below->value_mm));
}

Rgb ColourMap::stepped_colour(double deviation_mm) const {
  if (std::isnan(deviation_mm)) return kNotScanned;
  for (const Step& step : steps_) {
    if (deviation_mm < step.to_mm ||
        (tolerance_ && deviation_mm == step.to_mm && deviation_mm == tolerance_->high_mm)) {
      return step.rgb;
    }
  }
  return steps_.back().rgb;
}

double colour_range_mm(double p99_mm, const std::optional<inspect::Tolerance>& tolerance) {
  double range = p99_mm;
  if (tolerance) {
    const double widest = std::max(std::abs(tolerance->low_mm), std::abs(tolerance->high_mm));
    if (widest > 0.0) range = std::clamp(range, 1.5 * widest, 4.0 * widest);
  }
  if (!(range > 0.0) || !std::isfinite(range)) return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(range)));
  for (const double factor : {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (range <= factor * decade * (1.0 + 1e-9)) return factor * decade;
  }
  return 10.0 * decade;
}

}  // namespace asbuilt::report
