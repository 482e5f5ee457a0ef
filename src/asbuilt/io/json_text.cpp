// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/json_text.h"

#include <algorithm>
#include <cmath>

namespace asbuilt::io {
namespace {

using Json = nlohmann::ordered_json;

bool fits_on_a_line(const Json& value) {
  if (value.is_object()) return value.empty();
  if (!value.is_array()) return true;
  return std::ranges::all_of(value, [](const Json& item) { return fits_on_a_line(item) && !item.is_object(); });
}

void append(std::string& text, const Json& value, std::size_t indent);

void append_inline(std::string& text, const Json& array) {
  text += '[';
  for (std::size_t i = 0; i < array.size(); ++i) {
    if (i > 0) text += ", ";
    append(text, array[i], 0);
  }
  text += ']';
}

void append_array(std::string& text, const Json& array, std::size_t indent) {
  text += '[';
  for (std::size_t i = 0; i < array.size(); ++i) {
    text += i > 0 ? ",\n" : "\n";
    text.append(indent + 2, ' ');
    append(text, array[i], indent + 2);
  }
  text += '\n';
  text.append(indent, ' ');
  text += ']';
}

void append_object(std::string& text, const Json& object, std::size_t indent) {
  text += '{';
  bool first = true;
  for (const auto& [key, value] : object.items()) {
    text += first ? "\n" : ",\n";
    first = false;
    text.append(indent + 2, ' ');
    text += Json(key).dump() + ": ";
    append(text, value, indent + 2);
  }
  text += '\n';
  text.append(indent, ' ');
  text += '}';
}

void append(std::string& text, const Json& value, std::size_t indent) {
  if (value.is_array() && fits_on_a_line(value)) {
    append_inline(text, value);
  } else if (value.is_array()) {
    append_array(text, value, indent);
  } else if (value.is_object() && !value.empty()) {
    append_object(text, value, indent);
  } else {
    // Bytes that are no UTF-8 (file names may be anything) must not throw.
    text += value.dump(-1, ' ', false, Json::error_handler_t::replace);
  }
}

}  // namespace

std::string json_text(const Json& value) {
  std::string text;
  append(text, value, 0);
  text += '\n';
  return text;
}

Json json_number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace asbuilt::io
