// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/text_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/io/number.h"

namespace asbuilt::io {
namespace {

using Fields = std::vector<std::string_view>;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

Separator separator_of(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return Separator::semicolon;
  if (line.find(',') != std::string_view::npos) return Separator::comma;
  return Separator::blanks;
}

/// The names in a header, which some programs (CloudCompare) hide in a comment.
Fields names_in(std::string_view line, std::vector<std::string>& storage) {
  line = trimmed(line);
  while (line.starts_with('#') || line.starts_with('/')) line.remove_prefix(1);
  Fields fields;
  split_fields(line, separator_of(line), fields);
  storage.clear();
  storage.reserve(fields.size());  // the views below must stay valid
  for (std::string_view& field : fields) {
    std::string name = lower_case(field);
    std::erase_if(name, [](char c) { return c == '"' || c == '\''; });
    field = storage.emplace_back(std::move(name));
  }
  return fields;
}

std::optional<std::array<std::size_t, 3>> columns_named(const Fields& names,
                                                        const std::array<std::string_view, 3>& wanted) {
  std::array<std::size_t, 3> columns{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto found = std::ranges::find(names, wanted[axis]);
    if (found == names.end()) return std::nullopt;
    columns[axis] = static_cast<std::size_t>(found - names.begin());
  }
  return columns;
}

std::string no_numbers_in(std::string_view line) {
  return fmt::format(
      "found {}, expected numbers as x y z{}", in_quotes(trimmed(line)),
      separator_of(line) == Separator::comma ? " (where commas are decimal, part the values by semicolons)" : "");
}

/// Lines of numbers at the head of a file, and the names that stand before them.
struct Head {
  std::vector<std::vector<double>> rows;
  std::string_view names_line;
  std::size_t names_line_number = 0;
  std::string_view comment;  ///< the last one before the numbers
  std::size_t first_line = 0;
};

Result<Head> read_head(const Input& input, TextLayout& layout) {
  constexpr std::size_t kMostRows = 1000;
  Head head;
  LineCursor lines(input.content);
  Fields fields;
  while (head.rows.size() < kMostRows && lines.next()) {
    const std::string_view line = lines.line();
    if (is_comment(line)) {
      if (head.rows.empty() && !trimmed(line).empty()) head.comment = line;
      continue;
    }
    if (count_line(line)) continue;
    if (head.rows.empty()) layout.separator = separator_of(line);
    split_fields(line, layout.separator, fields);
    std::vector<double> row;
    for (const std::string_view field : fields) {
      if (const auto number = parse_field(field, layout.separator)) row.push_back(*number);
    }
    if (row.size() == fields.size()) {
      if (head.rows.empty()) head.first_line = lines.number();
      head.rows.push_back(std::move(row));
      continue;
    }
    if (!head.rows.empty()) break;  // the reader proper will say what is wrong there
    if (head.names_line_number != 0) {
      return input.error_at_line(lines.number(), no_numbers_in(line));
    }
    head.names_line = line;
    head.names_line_number = lines.number();
  }
  if (head.rows.empty() && head.names_line_number != 0) {
    return input.error_at_line(head.names_line_number, no_numbers_in(head.names_line));
  }
  if (head.rows.empty()) return input.error("the file holds no line of numbers, expected points as x y z");
  return head;
}

/// Whether three neighbouring columns look like normals: unit length nearly everywhere, and not always the same.
bool looks_like_normals(const std::vector<std::vector<double>>& rows, std::size_t column) {
  std::size_t unit = 0;
  bool varies = false;
  for (const std::vector<double>& row : rows) {
    const double length = std::hypot(row[column], row[column + 1], row[column + 2]);
    if (std::abs(length - 1.0) < 0.01) ++unit;
    for (std::size_t i = column; i < column + 3; ++i) varies = varies || row[i] != rows.front()[i];
  }
  return varies && static_cast<double>(unit) >= 0.95 * static_cast<double>(rows.size());
}

std::string_view name_of(Separator separator) {
  switch (separator) {
    case Separator::blanks:
      return "blanks";
    case Separator::comma:
      return "commas";
    case Separator::semicolon:
      return "semicolons";
  }
  throw std::logic_error("asbuilt: expected a separator");
}

/// Whether three neighbouring columns look like colours: whole numbers from 0 to 255, and not always the same.
bool looks_like_colours(const std::vector<std::vector<double>>& rows, std::size_t column) {
  bool varies = false;
  for (const std::vector<double>& row : rows) {
    for (std::size_t i = column; i < column + 3; ++i) {
      if (!(row[i] >= 0.0 && row[i] <= 255.0 && std::floor(row[i]) == row[i])) return false;
      varies = varies || row[i] != rows.front()[i];
    }
  }
  return varies;
}

/// "1 to 3 were taken for x, y, z, 5 to 7 for the colour, the rest not used".
std::string description(const TextLayout& layout) {
  const auto range = [](const std::array<std::size_t, 3>& columns) {
    const bool in_a_row = columns[1] == columns[0] + 1 && columns[2] == columns[0] + 2;
    return in_a_row ? fmt::format("{} to {}", columns[0] + 1, columns[2] + 1)
                    : fmt::format("{}, {}, {}", columns[0] + 1, columns[1] + 1, columns[2] + 1);
  };
  std::string text = fmt::format("columns {} were taken for x, y, z", range(layout.position));
  std::size_t used = 3;
  if (layout.normal) text += fmt::format(", columns {} for normals", range(*layout.normal)), used += 3;
  if (layout.colour) text += fmt::format(", columns {} for the colour", range(*layout.colour)), used += 3;
  if (layout.intensity) text += fmt::format(", column {} for the intensity", *layout.intensity + 1), used += 1;
  return text + (used < layout.columns ? ", the rest not used" : ", nothing else");
}

void take_columns_by_place(Head& head, TextLayout& layout) {
  std::erase_if(head.rows, [&](const std::vector<double>& row) { return row.size() != layout.columns; });
  for (std::size_t c = 3; c + 3 <= layout.columns && !layout.normal; ++c) {
    if (looks_like_normals(head.rows, c)) layout.normal = {c, c + 1, c + 2};
  }
  const auto is_free = [&](std::size_t c) {
    return !layout.normal || c + 2 < (*layout.normal)[0] || c > (*layout.normal)[2];
  };
  for (std::size_t c = 3; c + 3 <= layout.columns && !layout.colour; ++c) {
    if (is_free(c) && looks_like_colours(head.rows, c)) layout.colour = {c, c + 1, c + 2};
  }
  // x y z intensity, also before colours: what PTS files have.
  const bool is_pts = (layout.columns == 4 || (layout.columns == 7 && layout.colour)) && !layout.normal;
  if (is_pts && (!layout.colour || (*layout.colour)[0] == 4)) layout.intensity = 3;
  layout.notes.push_back(fmt::format("{} columns parted by {}: {}; --columns says otherwise.", layout.columns,
                                     name_of(layout.separator), description(layout)));
}

/// False when the names tell nothing about x, y and z.
bool take_columns_by_name(const Fields& names, TextLayout& layout) {
  const auto position = columns_named(names, {"x", "y", "z"});
  if (!position || names.size() != layout.columns) return false;
  layout.position = *position;
  layout.normal = columns_named(names, {"nx", "ny", "nz"});
  if (!layout.normal) layout.normal = columns_named(names, {"normal_x", "normal_y", "normal_z"});
  layout.colour = columns_named(names, {"r", "g", "b"});
  if (!layout.colour) layout.colour = columns_named(names, {"red", "green", "blue"});
  for (const std::string_view name : {"i", "intensity", "scalar_intensity"}) {
    const auto found = std::ranges::find(names, name);
    if (found != names.end()) layout.intensity = static_cast<std::size_t>(found - names.begin());
  }
  layout.notes.push_back(fmt::format("{} columns parted by {}: x, y, z{} were taken by the names in the header.",
                                     layout.columns, name_of(layout.separator),
                                     layout.normal ? " and the normal" : ""));
  return true;
}

/// The columns as the user states them.
Result<void> take_columns_as_stated(const Input& input, std::string_view stated, std::size_t first_line,
                                    TextLayout& layout) {
  std::vector<std::string> storage;
  Fields names = names_in(stated, storage);
  const auto wrong = [&](std::string_view what) {
    return fail(
        ErrorCode::invalid_argument,
        fmt::format("--columns {}: {}, expected names out of x y z nx ny nz r g b i parted by commas, and - for "
                    "what is passed over",
                    in_quotes(stated), what));
  };
  for (std::string_view& name : names) {
    if (name == "red") name = "r";
    if (name == "green") name = "g";
    if (name == "blue") name = "b";
    if (name == "intensity") name = "i";
    constexpr std::array<std::string_view, 11> kKnown{"x", "y", "z", "nx", "ny", "nz", "r", "g", "b", "i", "-"};
    if (std::ranges::find(kKnown, name) == kKnown.end()) return wrong(fmt::format("found {}", in_quotes(name)));
    if (name != "-" && std::ranges::count(names, name) > 1)
      return wrong(fmt::format("found {} twice", in_quotes(name)));
  }
  const auto position = columns_named(names, {"x", "y", "z"});
  if (!position) return wrong("x, y and z are not all among them");
  if (names.size() != layout.columns) {
    return input.error_at_line(first_line,
                               fmt::format("found {} values, --columns names {}", layout.columns, names.size()));
  }
  layout.position = *position;
  layout.normal = columns_named(names, {"nx", "ny", "nz"});
  layout.colour = columns_named(names, {"r", "g", "b"});
  if (const auto found = std::ranges::find(names, std::string_view("i")); found != names.end()) {
    layout.intensity = static_cast<std::size_t>(found - names.begin());
  }
  layout.notes.push_back(fmt::format("{} columns parted by {}, as --columns states: {}.", layout.columns,
                                     name_of(layout.separator), description(layout)));
  return {};
}

}  // namespace

void split_fields(std::string_view line, Separator separator, std::vector<std::string_view>& fields) {
  fields.clear();
  if (separator == Separator::blanks) {
    WordCursor words(line);
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) fields.push_back(word);
    return;
  }
  const char mark = separator == Separator::comma ? ',' : ';';
  line = trimmed(line);
  while (!line.empty()) {
    const std::size_t end = std::min(line.find(mark), line.size());
    fields.push_back(trimmed(line.substr(0, end)));
    line.remove_prefix(std::min(end + 1, line.size()));
  }
}

std::optional<double> parse_field(std::string_view field, Separator separator) {
  if (field.empty()) return std::numeric_limits<double>::quiet_NaN();
  if (separator != Separator::semicolon || field.find(',') == std::string_view::npos) return parse_number(field);
  std::string with_point(field);
  std::ranges::replace(with_point, ',', '.');
  return parse_number(with_point);
}

bool is_comment(std::string_view line) {
  line = trimmed(line);
  return line.empty() || line.starts_with('#') || line.starts_with("//");
}

std::optional<std::uint64_t> count_line(std::string_view line) { return parse_count(trimmed(line)); }

Result<TextLayout> layout_of(const Input& input, std::string_view stated_columns) {
  TextLayout layout;
  ASBUILT_TRY(head, read_head(input, layout));
  layout.columns = head.rows.front().size();
  layout.header_line = head.names_line_number;
  if (layout.columns < 3) {
    return input.error_at_line(head.first_line,
                               fmt::format("found {} numbers, expected at least x y z", layout.columns));
  }
  if (!stated_columns.empty()) {
    ASBUILT_CHECK(take_columns_as_stated(input, stated_columns, head.first_line, layout));
    return layout;
  }
  std::vector<std::string> storage;
  if (take_columns_by_name(names_in(head.names_line, storage), layout)) return layout;
  if (take_columns_by_name(names_in(head.comment, storage), layout)) return layout;
  take_columns_by_place(head, layout);
  return layout;
}

}  // namespace asbuilt::io
