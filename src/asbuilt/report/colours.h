// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "asbuilt/inspect/tolerance.h"

namespace asbuilt::report {

using Rgb = std::array<std::uint8_t, 3>;

/// Colours of signed deviations: blue below, white, red above; told apart by readers who see no red or no green too,
/// and by lightness alone as to size. The hues are those of ColorBrewer's RdBu scheme (C. Brewer, 2002).
class ColourMap {
 public:
  struct Stop {
    double value_mm = 0.0;
    Rgb rgb{};
  };
  struct Step {
    double from_mm = 0.0, to_mm = 0.0;
    Rgb rgb{};
  };

  static constexpr Rgb kNotScanned{154, 158, 163};  ///< grey, never a colour of the map

  /// `range_mm` either way. Within a tolerance colours stay pale and leap where it ends. Symmetric about zero as to
  /// range, whatever the tolerance.
  ColourMap(double range_mm, const std::optional<inspect::Tolerance>& tolerance);

  [[nodiscard]] double range_mm() const { return range_mm_; }
  [[nodiscard]] const std::optional<inspect::Tolerance>& tolerance() const { return tolerance_; }
  [[nodiscard]] const std::vector<Stop>& stops() const { return stops_; }  ///< ascending; linear between them in sRGB
  /// The same in equal steps either side of zero; with a tolerance that is symmetric enough, a step ends at its ends.
  [[nodiscard]] const std::vector<Step>& steps() const { return steps_; }

  /// The colour of a deviation; of NaN that of what was not scanned. Beyond the range the outermost.
  [[nodiscard]] Rgb colour(double deviation_mm) const;
  [[nodiscard]] Rgb stepped_colour(double deviation_mm) const;

 private:
  double range_mm_;
  std::optional<inspect::Tolerance> tolerance_;
  std::vector<Stop> stops_;
  std::vector<Step> steps_;
};

/// A range that shows the deviations well: the next of 1, 2, 5, 10 ... above their 99th percentile, at least one and a
/// half and at most four times the tolerance.
[[nodiscard]] double colour_range_mm(double p99_mm, const std::optional<inspect::Tolerance>& tolerance);

}  // namespace asbuilt::report
