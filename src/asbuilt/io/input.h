// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "asbuilt/core/result.h"

namespace asbuilt::io {

/// The content of a file that is being read, under the name that its errors carry.
struct Input {
  std::string name;
  std::string_view content;

  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const;
  [[nodiscard]] tl::unexpected<Error> error_at_line(std::size_t line, std::string_view what) const;
  [[nodiscard]] tl::unexpected<Error> error_at_byte(std::size_t byte, std::string_view what) const;
};

/// Something from a file in quotes, short and printable, for an error message.
[[nodiscard]] std::string in_quotes(std::string_view found);

/// ASCII lower case; never asks the locale.
[[nodiscard]] std::string lower_case(std::string_view text);

}  // namespace asbuilt::io
