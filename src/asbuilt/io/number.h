// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace asbuilt::io {

/// The number that makes up the whole word, whatever the locale; also nan, inf and the spellings of old Windows
/// runtimes ("1.#QNAN"). Too large gives infinity, too small zero.
[[nodiscard]] std::optional<double> parse_number(std::string_view word);

/// The integer that makes up the whole word; also one written as a real, "3.0".
[[nodiscard]] std::optional<std::int64_t> parse_integer(std::string_view word);

/// The count of things that makes up the whole word: digits only.
[[nodiscard]] std::optional<std::uint64_t> parse_count(std::string_view word);

}  // namespace asbuilt::io
