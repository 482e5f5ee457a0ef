// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

// Private to sources that write JSON: never include this from a public header.
namespace asbuilt::io {

/// JSON as people like to read it: two blanks a level, arrays of plain values (and of such arrays) on one line.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& value);

/// The number, or null for what JSON cannot say (NaN and the infinities).
[[nodiscard]] nlohmann::ordered_json json_number(double value);

}  // namespace asbuilt::io
