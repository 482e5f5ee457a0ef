// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

enum class PcdEncoding { ascii, binary, binary_compressed };

struct PcdField {
  std::string name;
  std::size_t size = 4;   ///< bytes of one value: 1, 2, 4 or 8
  char type = 'F';        ///< I, U or F
  std::size_t count = 1;  ///< values a point
};

/// What the head of a PCD file (version 0.5 to 0.7) declares. Invariant: point_size is the sum of size * count.
struct PcdHeader {
  std::vector<PcdField> fields;
  std::uint64_t points = 0;
  std::uint64_t width = 0, height = 0;                   ///< a height above 1 makes a grid; 0: not declared
  std::size_t point_size = 0;                            ///< bytes a point
  std::size_t point_values = 0;                          ///< values a point
  std::array<double, 7> viewpoint{0, 0, 0, 1, 0, 0, 0};  ///< tx ty tz qw qx qy qz
  PcdEncoding encoding = PcdEncoding::ascii;
  std::size_t body_begin = 0, lines = 0;

  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;
};

/// Errors: unreadable_input with the line.
[[nodiscard]] Result<PcdHeader> read_pcd_header(const Input& input);

[[nodiscard]] std::string_view name_of(PcdEncoding encoding);

}  // namespace asbuilt::io
