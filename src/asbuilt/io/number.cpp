// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/number.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

namespace asbuilt::io {
namespace {

/// Whether the digits of a number too large or too small for double say that it is small.
bool is_tiny(std::string_view word) {
  const std::size_t exponent = word.find_first_of("eE");
  if (exponent != std::string_view::npos) return word.substr(exponent + 1).starts_with('-');
  return word.find_first_of("123456789") > word.find('.');
}

std::optional<double> parse_windows_spelling(std::string_view word) {
  const bool negative = word.starts_with('-');
  if (negative) word.remove_prefix(1);
  if (word.starts_with("1.#QNAN") || word.starts_with("1.#SNAN") || word.starts_with("1.#IND")) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  if (word.starts_with("1.#INF")) return (negative ? -1.0 : 1.0) * std::numeric_limits<double>::infinity();
  return std::nullopt;
}

}  // namespace

std::optional<double> parse_number(std::string_view word) {
  // std::from_chars knows no plus sign.
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool whole = end == word.data() + word.size();
  if (error == std::errc{} && whole) return value;
  if (error == std::errc::result_out_of_range && whole) {
    const double sign = word.starts_with('-') ? -1.0 : 1.0;
    return is_tiny(word) ? 0.0 : sign * std::numeric_limits<double>::infinity();
  }
  return parse_windows_spelling(word);
}

std::optional<std::int64_t> parse_integer(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc{} && end == word.data() + word.size()) return value;
  const std::optional<double> real = parse_number(word);
  // Beyond 2^53 a double no longer tells which integer was meant.
  if (!real || std::floor(*real) != *real || std::abs(*real) > 0x1p53) return std::nullopt;
  return static_cast<std::int64_t>(*real);
}

std::optional<std::uint64_t> parse_count(std::string_view word) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc{} && end == word.data() + word.size()) return value;
  return std::nullopt;
}

}  // namespace asbuilt::io
