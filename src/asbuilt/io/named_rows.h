// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

/// One line of a table whose first column is a name.
struct NamedRow {
  std::string name;
  std::vector<double> values;
  std::size_t line = 0;
};

/// Reads lines of a name and `count` finite numbers, parted by commas or semicolons (then with decimal commas, if one
/// likes). `shape` tells the user what a line looks like. The first line may be a header. Names are unique.
[[nodiscard]] Result<std::vector<NamedRow>> read_named_rows(const Input& input, std::size_t count,
                                                            std::string_view shape);

}  // namespace asbuilt::io
