// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/lines.h"

namespace asbuilt::io {

enum class Separator { blanks, comma, semicolon };

/// The fields of a line; blanks around them do not count, nor does a separator at the end of the line.
void split_fields(std::string_view line, Separator separator, std::vector<std::string_view>& fields);

/// A field as a number: an empty one is NaN; a decimal comma is understood where semicolons part the fields.
[[nodiscard]] std::optional<double> parse_field(std::string_view field, Separator separator);

/// Whether the line is empty or a comment (# or //).
[[nodiscard]] bool is_comment(std::string_view line);

/// The count of points that stands alone on a line of a PTS file.
[[nodiscard]] std::optional<std::uint64_t> count_line(std::string_view line);

/// How the lines of a text file are to be understood.
struct TextLayout {
  Separator separator = Separator::blanks;
  std::size_t columns = 0;                           ///< in every line
  std::array<std::size_t, 3> position{0, 1, 2};      ///< columns of x, y, z
  std::optional<std::array<std::size_t, 3>> normal;  ///< columns of nx, ny, nz
  std::optional<std::array<std::size_t, 3>> colour;  ///< columns of red, green, blue, 0 to 255
  std::optional<std::size_t> intensity;
  std::size_t header_line = 0;     ///< number of the line that names the columns, 0 if there is none
  std::vector<std::string> notes;  ///< what was guessed
};

/// Decides from the head of a file (names of columns, and up to 1000 lines of numbers), or takes the columns that the
/// user states: names x y z nx ny nz r g b i parted by commas, with - for what is to be passed over.
/// Errors: unreadable_input when no line of at least three numbers is found, or the stated columns do not fit;
/// invalid_argument when they make no sense.
[[nodiscard]] Result<TextLayout> layout_of(const Input& input, std::string_view stated_columns);

}  // namespace asbuilt::io
