// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/input.h"

#include <fmt/format.h>

namespace asbuilt::io {

tl::unexpected<Error> Input::error(std::string_view what) const {
  return fail(ErrorCode::unreadable_input, fmt::format("{}: {}", name, what));
}

tl::unexpected<Error> Input::error_at_line(std::size_t line, std::string_view what) const {
  return fail(ErrorCode::unreadable_input, fmt::format("{}, line {}: {}", name, line, what));
}

tl::unexpected<Error> Input::error_at_byte(std::size_t byte, std::string_view what) const {
  return fail(ErrorCode::unreadable_input, fmt::format("{}, byte {}: {}", name, byte, what));
}

std::string in_quotes(std::string_view found) {
  constexpr std::size_t kLongest = 40;
  std::string text = "'";
  for (const char c : found.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (found.size() > kLongest ? "...'" : "'");
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

}  // namespace asbuilt::io
