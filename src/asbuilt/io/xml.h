// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

struct XmlElement {
  std::string name;  ///< with its prefix, as in "nor:normalX"
  std::vector<std::pair<std::string, std::string>> attributes;
  std::string text;  ///< what stands between its tags, without its children
  std::vector<XmlElement> children;

  [[nodiscard]] const XmlElement* child(std::string_view child_name) const;  ///< the first of that name; or nullptr
  [[nodiscard]] std::optional<std::string_view> attribute(std::string_view attribute_name) const;
};

/// The root element of a well-formed XML text in UTF-8, as far as data files need XML: elements, attributes, text,
/// CDATA, comments, the five named entities and character references. No DTD, so nothing can expand.
/// Errors: unreadable_input with the byte.
[[nodiscard]] Result<XmlElement> parse_xml(const Input& input);

}  // namespace asbuilt::io
