// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/pcd_header.h"

#include <fmt/format.h>

#include <algorithm>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"

namespace asbuilt::io {
namespace {

class HeaderReader {
 public:
  explicit HeaderReader(const Input& input) : input_(input), lines_(input.content) {}

  Result<PcdHeader> read() {
    while (lines_.next_with_content()) {
      WordCursor words(lines_.line());
      const std::string_view keyword = words.next();
      if (keyword.starts_with('#')) continue;
      std::vector<std::string_view> values;
      for (std::string_view word = words.next(); !word.empty(); word = words.next()) values.push_back(word);
      if (keyword == "DATA") return finish(values);
      ASBUILT_CHECK(read_line(keyword, values));
    }
    return input_.error_at_line(lines_.number() + 1, "the file ends within the PCD header, expected 'DATA'");
  }

 private:
  using Words = std::vector<std::string_view>;

  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const {
    return input_.error_at_line(lines_.number(), what);
  }

  Result<void> read_line(std::string_view keyword, const Words& values) {
    if (keyword == "VERSION") return {};
    if (keyword == "FIELDS" || keyword == "COLUMNS") return read_fields(values);
    if (keyword == "SIZE") return read_sizes(values);
    if (keyword == "TYPE") return read_types(values);
    if (keyword == "COUNT") return read_counts(values);
    if (keyword == "WIDTH") return read_count(keyword, values, width_);
    if (keyword == "HEIGHT") return read_count(keyword, values, height_);
    if (keyword == "POINTS") return read_count(keyword, values, points_);
    if (keyword == "VIEWPOINT") return read_viewpoint(values);
    return error(fmt::format("found {}, expected a PCD keyword such as FIELDS, SIZE or DATA", in_quotes(keyword)));
  }

  Result<void> read_fields(const Words& values) {
    if (!header_.fields.empty()) return error("FIELDS stands twice");
    for (const std::string_view name : values) header_.fields.push_back({std::string(name)});
    return {};
  }

  Result<void> check_length(std::string_view keyword, const Words& values) const {
    if (values.size() == header_.fields.size()) return {};
    return error(fmt::format("{} has {} values for {} fields", keyword, values.size(), header_.fields.size()));
  }

  Result<void> read_sizes(const Words& values) {
    ASBUILT_CHECK(check_length("SIZE", values));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto size = parse_count(values[i]);
      if (!size || (*size != 1 && *size != 2 && *size != 4 && *size != 8)) {
        return error(fmt::format("SIZE of field {} is {}, expected 1, 2, 4 or 8", in_quotes(header_.fields[i].name),
                                 in_quotes(values[i])));
      }
      header_.fields[i].size = static_cast<std::size_t>(*size);
    }
    return {};
  }

  Result<void> read_types(const Words& values) {
    ASBUILT_CHECK(check_length("TYPE", values));
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] != "I" && values[i] != "U" && values[i] != "F") {
        return error(fmt::format("TYPE of field {} is {}, expected I, U or F", in_quotes(header_.fields[i].name),
                                 in_quotes(values[i])));
      }
      header_.fields[i].type = values[i][0];
    }
    return {};
  }

  Result<void> read_counts(const Words& values) {
    ASBUILT_CHECK(check_length("COUNT", values));
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto count = parse_count(values[i]);
      // The bound is far beyond any descriptor and keeps the sums below from overflowing.
      if (!count || *count == 0 || *count > 1'000'000) {
        return error(fmt::format("COUNT of field {} is {}, expected 1 or more", in_quotes(header_.fields[i].name),
                                 in_quotes(values[i])));
      }
      header_.fields[i].count = static_cast<std::size_t>(*count);
    }
    return {};
  }

  Result<void> read_count(std::string_view keyword, const Words& values, std::optional<std::uint64_t>& target) const {
    target = values.empty() ? std::nullopt : parse_count(values[0]);
    if (target) return {};
    return error(fmt::format("{} is {}, expected a count", keyword, in_quotes(values.empty() ? "" : values[0])));
  }

  Result<void> read_viewpoint(const Words& values) {
    if (values.size() != 7)
      return error(fmt::format("VIEWPOINT has {} values, expected tx ty tz qw qx qy qz", values.size()));
    for (std::size_t i = 0; i < 7; ++i) {
      const auto number = parse_number(values[i]);
      if (!number) return error(fmt::format("VIEWPOINT holds {}, expected a number", in_quotes(values[i])));
      header_.viewpoint[i] = *number;
    }
    return {};
  }

  Result<void> choose_encoding(const Words& values) {
    const std::string_view name = values.empty() ? "" : values[0];
    if (name == "ascii")
      header_.encoding = PcdEncoding::ascii;
    else if (name == "binary")
      header_.encoding = PcdEncoding::binary;
    else if (name == "binary_compressed")
      header_.encoding = PcdEncoding::binary_compressed;
    else
      return error(fmt::format("DATA is {}, expected ascii, binary or binary_compressed", in_quotes(name)));
    return {};
  }

  /// POINTS may be missing in old files, then WIDTH times HEIGHT stands for it.
  Result<void> settle_points() {
    const bool has_grid = width_ && height_;
    if (!points_ && !has_grid) return error("the PCD header has neither POINTS nor WIDTH and HEIGHT");
    const auto grid = static_cast<__uint128_t>(width_.value_or(0)) * height_.value_or(0);
    if (grid > ~std::uint64_t{0} || (points_ && has_grid && grid != *points_)) {
      return error(fmt::format("POINTS is {}, but WIDTH x HEIGHT is {} x {}", points_.value_or(0), *width_, *height_));
    }
    header_.points = points_.value_or(static_cast<std::uint64_t>(grid));
    header_.width = width_.value_or(0);
    header_.height = height_.value_or(0);
    return {};
  }

  Result<PcdHeader> finish(const Words& values) {
    ASBUILT_CHECK(choose_encoding(values));
    ASBUILT_CHECK(settle_points());
    for (const PcdField& field : header_.fields) {
      if (field.type == 'F' && field.size < 4) {
        return error(fmt::format("field {} is a real of {} bytes, expected 4 or 8", in_quotes(field.name), field.size));
      }
      header_.point_size += field.size * field.count;
      header_.point_values += field.count;
    }
    header_.body_begin = lines_.end();
    header_.lines = lines_.number();
    return std::move(header_);
  }

  const Input& input_;
  LineCursor lines_;
  PcdHeader header_;
  std::optional<std::uint64_t> width_, height_, points_;
};

}  // namespace

std::optional<std::size_t> PcdHeader::find(std::string_view name) const {
  const auto found = std::ranges::find_if(fields, [&](const PcdField& f) { return lower_case(f.name) == name; });
  if (found == fields.end()) return std::nullopt;
  return static_cast<std::size_t>(found - fields.begin());
}

Result<PcdHeader> read_pcd_header(const Input& input) { return HeaderReader(input).read(); }

std::string_view name_of(PcdEncoding encoding) {
  switch (encoding) {
    case PcdEncoding::ascii:
      return "ascii";
    case PcdEncoding::binary:
      return "binary";
    case PcdEncoding::binary_compressed:
      return "binary_compressed";
  }
  throw std::logic_error("asbuilt: expected a PCD encoding");
}

}  // namespace asbuilt::io
