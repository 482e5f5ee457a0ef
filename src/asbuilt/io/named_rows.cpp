// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/named_rows.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <set>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/text_layout.h"

namespace asbuilt::io {
namespace {

using Fields = std::vector<std::string_view>;

std::string without_quotes(std::string_view name) {
  const bool quoted = name.size() >= 2 && name.front() == '"' && name.back() == '"';
  return std::string(quoted ? name.substr(1, name.size() - 2) : name);
}

/// A header has no number at all.
bool is_header(const Fields& fields, Separator separator) {
  for (const std::string_view field : fields) {
    if (!field.empty() && parse_field(field, separator)) return false;
  }
  return true;
}

}  // namespace

Result<std::vector<NamedRow>> read_named_rows(const Input& input, std::size_t count, std::string_view shape) {
  std::vector<NamedRow> rows;
  std::set<std::string> names;
  LineCursor lines(input.content);
  Fields fields;
  bool is_first = true;
  while (lines.next()) {
    if (is_comment(lines.line())) continue;
    const Separator separator =
        lines.line().find(';') != std::string_view::npos ? Separator::semicolon : Separator::comma;
    split_fields(lines.line(), separator, fields);
    const bool first = std::exchange(is_first, false);
    if (first && is_header(fields, separator)) continue;
    if (fields.size() != count + 1 || fields[0].empty()) {
      return input.error_at_line(lines.number(),
                                 fmt::format("found {} fields, expected {}: {}", fields.size(), count + 1, shape));
    }
    NamedRow row{without_quotes(fields[0]), {}, lines.number()};
    for (std::size_t i = 1; i < fields.size(); ++i) {
      const auto number = parse_field(fields[i], separator);
      if (!number || !std::isfinite(*number)) {
        return input.error_at_line(
            lines.number(), fmt::format("field {} is {}, expected a finite number", i + 1, in_quotes(fields[i])));
      }
      row.values.push_back(*number);
    }
    if (!names.insert(row.name).second) {
      return input.error_at_line(lines.number(), fmt::format("scan {} is named a second time", in_quotes(row.name)));
    }
    rows.push_back(std::move(row));
  }
  if (rows.empty()) return input.error(fmt::format("the file names no scan, expected lines {}", shape));
  return rows;
}

}  // namespace asbuilt::io
