// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

namespace asbuilt::report {

/// On the grid of the font: baseline at y = 0, capitals and digits 6 high, small letters 4, tails down to -2.
struct StrokePoint {
  double x = 0.0, y = 0.0;
};

struct Letter {
  std::vector<std::vector<StrokePoint>> strokes;  ///< polylines; of one point: a dot
  double width = 0.0;
  std::size_t bytes = 1;  ///< that it takes in the text
};

/// The letter at a byte of a UTF-8 text; what the font does not have is a small box.
[[nodiscard]] Letter letter_at(std::string_view utf8, std::size_t place);

}  // namespace asbuilt::report
