// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/ply_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"

namespace asbuilt::io {
namespace {

std::optional<PlyType> type_from_name(std::string_view name) {
  constexpr std::pair<std::string_view, PlyType> kNames[] = {
      {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
      {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
      {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
      {"float64", PlyType::float64}};
  const auto* found = std::ranges::find(kNames, name, &std::pair<std::string_view, PlyType>::first);
  if (found == std::end(kNames)) return std::nullopt;
  return found->second;
}

std::optional<PlyEncoding> encoding_from_name(std::string_view name) {
  if (name == "ascii") return PlyEncoding::ascii;
  if (name == "binary_little_endian") return PlyEncoding::binary_little_endian;
  if (name == "binary_big_endian") return PlyEncoding::binary_big_endian;
  return std::nullopt;
}

/// Reads the header line by line; each line is one keyword and its words.
class HeaderReader {
 public:
  explicit HeaderReader(const Input& input) : input_(input), lines_(input.content) {}

  Result<PlyHeader> read() {
    if (!lines_.next() || lines_.line() != "ply") return error("the file does not begin with 'ply'");
    while (lines_.next()) {
      WordCursor words(lines_.line());
      const std::string_view keyword = words.next();
      if (keyword == "end_header") return finish();
      ASBUILT_CHECK(read_line(keyword, words));
    }
    return input_.error_at_line(lines_.number() + 1, "the file ends within the PLY header, expected 'end_header'");
  }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const {
    return input_.error_at_line(std::max<std::size_t>(lines_.number(), 1), what);
  }

  Result<void> read_line(std::string_view keyword, WordCursor& words) {
    if (keyword == "format") return read_format(words);
    if (keyword == "element") return read_element(words);
    if (keyword == "property") return read_property(words);
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) return {};
    return error(fmt::format("found {}, expected format, element, property, comment, obj_info or end_header",
                             in_quotes(keyword)));
  }

  Result<void> read_format(WordCursor& words) {
    const std::string_view name = words.next();
    const auto encoding = encoding_from_name(name);
    if (!encoding) {
      return error(
          fmt::format("format is {}, expected ascii, binary_little_endian or binary_big_endian", in_quotes(name)));
    }
    if (const std::string_view version = words.next(); version != "1.0") {
      return error(fmt::format("format version is {}, expected 1.0", in_quotes(version)));
    }
    header_.encoding = *encoding;
    has_format_ = true;
    return {};
  }

  Result<void> read_element(WordCursor& words) {
    const std::string_view name = words.next(), count = words.next();
    const auto rows = parse_count(count);
    if (name.empty() || !rows) {
      return error(
          fmt::format("element {} has the count {}, expected 'element NAME COUNT'", in_quotes(name), in_quotes(count)));
    }
    header_.elements.push_back({std::string(name), *rows, {}});
    return {};
  }

  Result<void> read_property(WordCursor& words) {
    if (header_.elements.empty()) return error("a property stands before the first element");
    PlyProperty property;
    std::string_view type_name = words.next();
    if (type_name == "list") {
      const std::string_view count_name = words.next();
      property.list_count_type = type_from_name(count_name);
      if (!property.list_count_type || *property.list_count_type >= PlyType::float32) {
        return error(fmt::format("a list is counted in {}, expected an integer type", in_quotes(count_name)));
      }
      type_name = words.next();
    }
    const auto type = type_from_name(type_name);
    if (!type)
      return error(fmt::format("property type is {}, expected for example float or int", in_quotes(type_name)));
    property.type = *type;
    property.name = words.next();
    if (property.name.empty()) return error("a property has no name");
    header_.elements.back().properties.push_back(std::move(property));
    return {};
  }

  Result<PlyHeader> finish() {
    if (!has_format_) return error("the PLY header has no line 'format'");
    header_.body_begin = lines_.end();
    header_.lines = lines_.number();
    return std::move(header_);
  }

  const Input& input_;
  LineCursor lines_;
  PlyHeader header_;
  bool has_format_ = false;
};

}  // namespace

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      return 8;
  }
  throw std::logic_error("asbuilt: expected a PLY type");
}

bool PlyElement::has_lists() const { return std::ranges::any_of(properties, &PlyProperty::is_list); }

std::optional<std::size_t> PlyElement::find(std::string_view wanted) const {
  const auto found =
      std::ranges::find_if(properties, [&](const PlyProperty& p) { return lower_case(p.name) == wanted; });
  if (found == properties.end()) return std::nullopt;
  return static_cast<std::size_t>(found - properties.begin());
}

std::optional<std::size_t> PlyHeader::find_element(std::string_view wanted) const {
  const auto found = std::ranges::find_if(elements, [&](const PlyElement& e) { return lower_case(e.name) == wanted; });
  if (found == elements.end()) return std::nullopt;
  return static_cast<std::size_t>(found - elements.begin());
}

Result<PlyHeader> read_ply_header(const Input& input) { return HeaderReader(input).read(); }

std::string_view name_of(PlyEncoding encoding) {
  switch (encoding) {
    case PlyEncoding::ascii:
      return "ascii";
    case PlyEncoding::binary_little_endian:
      return "binary_little_endian";
    case PlyEncoding::binary_big_endian:
      return "binary_big_endian";
  }
  throw std::logic_error("asbuilt: expected a PLY encoding");
}

}  // namespace asbuilt::io
