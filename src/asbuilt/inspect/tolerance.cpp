// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/tolerance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "asbuilt/io/file.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/text_layout.h"

namespace asbuilt::inspect {
namespace {

constexpr const char* kShapes = "FACE,LOW,HIGH or NAME,LOW,HIGH,X1,Y1,Z1,X2,Y2,Z2";

/// The number in "12" or "face 12".
std::optional<int> face_number(std::string_view text) {
  const std::string lower = io::lower_case(text);
  std::string_view digits = lower;
  if (digits.starts_with("face")) {
    digits.remove_prefix(4);
    while (!digits.empty() && (digits.front() == ' ' || digits.front() == '_')) digits.remove_prefix(1);
  }
  const auto number = io::parse_count(digits);
  return number && *number < 100'000'000 ? std::optional(static_cast<int>(*number)) : std::nullopt;
}

Result<Tolerance> tolerance_of(const io::Input& input, std::size_t line, double low, double high) {
  if (std::isfinite(low) && std::isfinite(high) && low <= high) return Tolerance{low, high};
  return input.error_at_line(line, fmt::format("the tolerance is {} to {} mm, expected LOW <= HIGH", low, high));
}

/// Adds a row, or says that its face or name was there before.
Result<void> add(ToleranceTable& table, ToleranceRow row, const io::Input& input, std::size_t line) {
  for (const ToleranceRow& other : table.rows) {
    const bool is_face = row.box == std::nullopt, other_is_face = other.box == std::nullopt;
    const bool same = is_face == other_is_face && row.face == other.face && row.face_name == other.face_name &&
                      (is_face || row.name == other.name);
    if (!same) continue;
    return input.error_at_line(line, fmt::format("{} is given a second tolerance; the first is on line {}",
                                                 io::in_quotes(row.name), other.place));
  }
  row.place = line;
  table.rows.push_back(std::move(row));
  return {};
}

/// Whether a first line names columns: no field but the first is a number, and that is a word.
bool is_header(const std::vector<std::string_view>& fields, io::Separator separator) {
  return std::ranges::none_of(fields, [&](std::string_view field) {
    return field == "*" || (!field.empty() && io::parse_field(field, separator).has_value());
  });
}

Result<void> read_line(ToleranceTable& table, const io::Input& input, std::size_t line,
                       const std::vector<std::string_view>& fields, io::Separator separator) {
  if (fields.size() != 3 && fields.size() != 9) {
    return input.error_at_line(line, fmt::format("found {} fields, expected 3 or 9: {}", fields.size(), kShapes));
  }
  std::array<double, 8> numbers{};
  for (std::size_t i = 1; i < fields.size(); ++i) {
    const auto number = io::parse_field(fields[i], separator);
    if (!number || !std::isfinite(*number)) {
      return input.error_at_line(
          line, fmt::format("field {} is {}, expected a finite number", i + 1, io::in_quotes(fields[i])));
    }
    numbers[i - 1] = *number;
  }
  ASBUILT_TRY(tolerance, tolerance_of(input, line, numbers[0], numbers[1]));
  std::string_view name = fields[0];
  if (name.size() >= 2 && name.front() == '"' && name.back() == '"') name = name.substr(1, name.size() - 2);
  ToleranceRow row{std::string(name), std::nullopt, std::nullopt, tolerance, line};
  if (fields.size() == 9) {
    if (name.empty()) return input.error_at_line(line, "the box has no name");
    const Eigen::Vector3d first(numbers[2], numbers[3], numbers[4]), second(numbers[5], numbers[6], numbers[7]);
    row.box = Eigen::AlignedBox3d(first.cwiseMin(second), first.cwiseMax(second));
    return add(table, std::move(row), input, line);
  }
  if (name == "*" || io::lower_case(name) == "default") {
    if (table.others) return input.error_at_line(line, "the tolerance of all other faces is given a second time");
    table.others = tolerance;
    return {};
  }
  row.face = face_number(name);
  if (row.face) {
    row.name = fmt::format("face {}", *row.face);
    return add(table, std::move(row), input, line);
  }
  if (name.empty()) {
    return input.error_at_line(line,
                               fmt::format("the row names no face, expected the number or the name of a CAD face, "
                                           "or * for all others (a named box needs two corners: {})",
                                           kShapes));
  }
  row.face_name = name;  // whether the CAD has such a face is seen when it is there
  return add(table, std::move(row), input, line);
}

Result<ToleranceTable> read_csv(const io::Input& input) {
  ToleranceTable table;
  io::LineCursor lines(input.content);
  std::vector<std::string_view> fields;
  bool is_first = true;
  while (lines.next()) {
    if (io::is_comment(lines.line())) continue;
    const auto separator =
        lines.line().find(';') != std::string_view::npos ? io::Separator::semicolon : io::Separator::comma;
    io::split_fields(lines.line(), separator, fields);
    if (std::exchange(is_first, false) && is_header(fields, separator)) continue;
    ASBUILT_CHECK(read_line(table, input, lines.number(), fields, separator));
  }
  return table;
}

using Json = nlohmann::json;

/// Where each entry of the array "rows" (or of the outermost array) begins, as a line: the parser keeps no places.
class EntryLines {
 public:
  EntryLines(std::string_view text, int entry_depth) {
    std::size_t line = 1;
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
      const char c = text[i];
      if (c == '\n') ++line;
      if (in_string) {
        if (c == '\\') ++i;
        if (c == '"') in_string = false;
        continue;
      }
      if (c == '"') in_string = true;
      if (c == '{' && depth == entry_depth) lines_.push_back(line);
      if (c == '{' || c == '[') ++depth;
      if (c == '}' || c == ']') --depth;
    }
  }
  [[nodiscard]] std::size_t line_of(std::size_t entry) const { return entry < lines_.size() ? lines_[entry] : 1; }

 private:
  std::vector<std::size_t> lines_;
};

std::optional<std::vector<double>> numbers_in(const Json& value, std::size_t count) {
  if (!value.is_array() || value.size() != count) return std::nullopt;
  std::vector<double> numbers;
  for (const Json& number : value) {
    if (!number.is_number()) return std::nullopt;
    numbers.push_back(number.get<double>());
  }
  return numbers;
}

Result<void> read_entry(ToleranceTable& table, const io::Input& input, std::size_t line, const Json& entry) {
  if (!entry.is_object())
    return input.error_at_line(line, R"(expected an object like {"face": 3, "low": -0.1, "high": 0.1})");
  for (const char* key : {"low", "high"}) {
    if (entry.contains(key) && entry[key].is_number()) continue;
    return input.error_at_line(line, fmt::format("the row has no number \"{}\"", key));
  }
  ASBUILT_TRY(tolerance, tolerance_of(input, line, entry["low"].get<double>(), entry["high"].get<double>()));
  ToleranceRow row{entry.value("name", Json()).is_string() ? entry["name"].get<std::string>() : std::string(),
                   std::nullopt, std::nullopt, tolerance, line};
  const bool has_face = entry.contains("face"), has_box = entry.contains("box");
  if (has_face == has_box) return input.error_at_line(line, "the row needs either \"face\" or \"box\"");
  if (has_face) {
    const Json& face = entry["face"];
    if (face.is_number_unsigned() && face.get<std::uint64_t>() < 100'000'000) row.face = face.get<int>();
    if (face.is_string()) {
      row.face = face_number(face.get<std::string>());
      if (!row.face) row.face_name = face.get<std::string>();
    }
    if (!row.face && row.face_name.empty()) {
      return input.error_at_line(line,
                                 fmt::format("\"face\" is {}, expected the number of a CAD face, from 0, or its name",
                                             io::in_quotes(face.dump())));
    }
    if (row.name.empty()) row.name = row.face ? fmt::format("face {}", *row.face) : row.face_name;
    return add(table, std::move(row), input, line);
  }
  const Json& box = entry["box"];
  const auto first = box.is_array() && box.size() == 2 ? numbers_in(box[0], 3) : std::nullopt;
  const auto second = first ? numbers_in(box[1], 3) : std::nullopt;
  if (!second) return input.error_at_line(line, "\"box\" must be two corners, [[x, y, z], [x, y, z]]");
  if (row.name.empty()) return input.error_at_line(line, "the box has no \"name\"");
  const Eigen::Vector3d a(first->data()), b(second->data());
  row.box = Eigen::AlignedBox3d(a.cwiseMin(b), a.cwiseMax(b));
  return add(table, std::move(row), input, line);
}

Result<ToleranceTable> read_json(const io::Input& input) {
  Json json;
  try {
    json = Json::parse(input.content);
  } catch (const Json::parse_error& error) {
    const auto end = input.content.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, input.content.size()));
    const auto line = static_cast<std::size_t>(std::count(input.content.begin(), end, '\n')) + 1;
    return input.error_at_line(line, "the text is no JSON from here on");
  }
  ToleranceTable table;
  const bool is_list = json.is_array();
  if (!is_list && !json.contains("rows") && !json.contains("default")) {
    return input.error(R"(found neither "default" nor "rows", expected {"default": [LOW, HIGH], "rows": [...]})");
  }
  if (!is_list && json.contains("default")) {
    const auto both = numbers_in(json["default"], 2);
    if (!both) return input.error("\"default\" must be [LOW, HIGH]");
    if (!((*both)[0] <= (*both)[1])) {
      return input.error(fmt::format("\"default\" is {} to {} mm, expected LOW <= HIGH", (*both)[0], (*both)[1]));
    }
    table.others = Tolerance{(*both)[0], (*both)[1]};
  }
  const Json rows = is_list ? json : json.value("rows", Json::array());
  if (!rows.is_array()) return input.error("\"rows\" must be an array");
  const EntryLines lines(input.content, is_list ? 1 : 2);
  for (std::size_t i = 0; i < rows.size(); ++i) ASBUILT_CHECK(read_entry(table, input, lines.line_of(i), rows[i]));
  return table;
}

}  // namespace

Result<ToleranceTable> tolerances_in(std::string_view content, const std::string& name) {
  const io::Input input{name, content};
  const std::size_t first = content.find_first_not_of(" \t\r\n\xef\xbb\xbf");
  const bool is_json = first != std::string_view::npos && (content[first] == '{' || content[first] == '[');
  auto table = is_json ? read_json(input) : read_csv(input);
  if (table) table->source = name;
  if (table && !table->others && table->rows.empty()) {
    return input.error(fmt::format("the file holds no tolerance, expected lines {}", kShapes));
  }
  return table;
}

Result<ToleranceTable> read_tolerances(const std::filesystem::path& path) {
  ASBUILT_TRY(content, io::read_file(path));
  return tolerances_in(content, path.string());
}

}  // namespace asbuilt::inspect
