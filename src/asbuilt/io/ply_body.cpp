// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/ply_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "asbuilt/io/number.h"

namespace asbuilt::io {
namespace {

template <std::endian order>
ScalarLoader loader_in_order(PlyType type) {
  switch (type) {
    case PlyType::int8:
      return scalar_loader<std::int8_t, order>();
    case PlyType::uint8:
      return scalar_loader<std::uint8_t, order>();
    case PlyType::int16:
      return scalar_loader<std::int16_t, order>();
    case PlyType::uint16:
      return scalar_loader<std::uint16_t, order>();
    case PlyType::int32:
      return scalar_loader<std::int32_t, order>();
    case PlyType::uint32:
      return scalar_loader<std::uint32_t, order>();
    case PlyType::float32:
      return scalar_loader<float, order>();
    case PlyType::float64:
      return scalar_loader<double, order>();
  }
  throw std::logic_error("asbuilt: expected a PLY type");
}

ScalarLoader loader(PlyType type, PlyEncoding encoding) {
  return encoding == PlyEncoding::binary_big_endian ? loader_in_order<std::endian::big>(type)
                                                    : loader_in_order<std::endian::little>(type);
}

/// The fewest bytes a row can take: empty lists; in ascii one character and one separator a word.
std::size_t smallest_row(const PlyElement& element, PlyEncoding encoding) {
  std::size_t bytes = 0;
  for (const PlyProperty& property : element.properties) {
    bytes += encoding == PlyEncoding::ascii ? 2 : size_of(property.list_count_type.value_or(property.type));
  }
  return bytes;
}

/// Visitors of walk(): `scalar` for a value, `list` before the entries of a list, `entry` for each of them, `row` at
/// the end of a row. `entry` says whether the value is what it can take.
struct SkipRows {
  static constexpr bool kReadsValues = false;
  void scalar(std::size_t, double) {}
  bool entry(std::size_t, double) { return true; }
  void row() {}
};

struct CollectScalars {
  static constexpr bool kReadsValues = true;
  std::vector<double>& values;
  void scalar(std::size_t, double value) { values.push_back(value); }
  bool entry(std::size_t, double) { return true; }
  void row() {}
};

struct CollectList {
  static constexpr bool kReadsValues = true;
  std::size_t property;
  PlyLists& lists;
  void scalar(std::size_t, double) {}
  bool entry(std::size_t from, double value) {
    if (from != property) return true;
    if (std::floor(value) != value || std::abs(value) > 0x1p53) return false;  // NaN fails the first test
    lists.values.push_back(static_cast<std::int64_t>(value));
    return true;
  }
  void row() { lists.ends.push_back(lists.values.size()); }
};

}  // namespace

PlyBody::PlyBody(const Input& input, const PlyHeader& header)
    : input_(input),
      encoding_(header.encoding),
      position_(header.body_begin),
      lines_(input.content, header.body_begin, header.lines) {}

std::size_t PlyBody::bytes_left() const {
  return input_.content.size() - (encoding_ == PlyEncoding::ascii ? lines_.end() : position_);
}

tl::unexpected<Error> PlyBody::ends_after(const PlyElement& element, std::uint64_t rows) const {
  const std::string what = fmt::format("the file ends after {} of {} rows of element {}, it seems to be truncated",
                                       rows, element.rows, in_quotes(element.name));
  if (encoding_ == PlyEncoding::ascii) return input_.error_at_line(lines_.number() + 1, what);
  return input_.error_at_byte(input_.content.size(), what);
}

std::uint64_t PlyBody::rows_that_fit(const PlyElement& element) const {
  // The last line of an ascii file needs no line end.
  const std::size_t present = bytes_left() + (encoding_ == PlyEncoding::ascii ? 1 : 0);
  return std::min<std::uint64_t>(element.rows, present / smallest_row(element, encoding_));
}

template <class Visitor>
Result<void> PlyBody::walk(const PlyElement& element, Visitor& visitor) {
  if (element.properties.empty()) return {};  // rows of nothing take no room
  return encoding_ == PlyEncoding::ascii ? walk_ascii(element, visitor) : walk_binary(element, visitor);
}

template <class Visitor>
Result<void> PlyBody::walk_ascii(const PlyElement& element, Visitor& visitor) {
  for (std::uint64_t row = 0; row < element.rows; ++row) {
    if (!lines_.next_with_content()) return ends_after(element, row);
    WordCursor words(lines_.line());
    std::size_t found = 0;
    const auto next_number = [&]() -> Result<double> {
      const std::string_view word = words.next();
      if (word.empty()) {
        return input_.error_at_line(lines_.number(), fmt::format("row {} of {} has {} values, the header declares more",
                                                                 row, in_quotes(element.name), found));
      }
      ++found;
      if (const auto number = parse_number(word)) return *number;
      return input_.error_at_line(lines_.number(), fmt::format("found {}, expected a number", in_quotes(word)));
    };
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      ASBUILT_TRY(value, next_number());
      if (!element.properties[p].is_list()) {
        visitor.scalar(p, value);
        continue;
      }
      if (!(value >= 0.0 && value <= 0x1p53 && std::floor(value) == value)) {
        return input_.error_at_line(lines_.number(), fmt::format("a list has {} entries, expected a count", value));
      }
      for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(value); ++i) {
        ASBUILT_TRY(entry, next_number());
        if (!visitor.entry(p, entry)) {
          return input_.error_at_line(lines_.number(), fmt::format("found the index {}, expected an integer", entry));
        }
      }
    }
    if (!words.rest().empty()) {
      return input_.error_at_line(lines_.number(),
                                  fmt::format("row {} of {} has more than the {} values the header declares", row,
                                              in_quotes(element.name), found));
    }
    visitor.row();
  }
  return {};
}

template <class Visitor>
Result<void> PlyBody::walk_binary(const PlyElement& element, Visitor& visitor) {
  struct Step {
    std::size_t size, count_size;
    ScalarLoader load, load_count;
  };
  std::vector<Step> steps;
  for (const PlyProperty& property : element.properties) {
    Step step{size_of(property.type), 0, loader(property.type, encoding_), {}};
    if (property.is_list()) {
      step.count_size = size_of(*property.list_count_type);
      step.load_count = loader(*property.list_count_type, encoding_);
    }
    steps.push_back(step);
  }
  const char* const bytes = input_.content.data();
  const std::size_t end = input_.content.size();
  for (std::uint64_t row = 0; row < element.rows; ++row) {
    for (std::size_t p = 0; p < steps.size(); ++p) {
      const Step& step = steps[p];
      if (!step.load_count) {
        if (end - position_ < step.size) return ends_after(element, row);
        if constexpr (Visitor::kReadsValues) visitor.scalar(p, step.load(bytes + position_));
        position_ += step.size;
        continue;
      }
      if (end - position_ < step.count_size) return ends_after(element, row);
      const double count = step.load_count(bytes + position_);
      if (count < 0.0)
        return input_.error_at_byte(position_, fmt::format("a list has {} entries, expected a count", count));
      position_ += step.count_size;
      const std::size_t entries = static_cast<std::size_t>(count);
      if ((end - position_) / step.size < entries) return ends_after(element, row);
      if constexpr (Visitor::kReadsValues) {
        for (std::size_t i = 0; i < entries; ++i) {
          const double value = step.load(bytes + position_ + i * step.size);
          if (visitor.entry(p, value)) continue;
          return input_.error_at_byte(position_ + i * step.size,
                                      fmt::format("found the index {}, expected an integer", value));
        }
      }
      position_ += entries * step.size;
    }
    visitor.row();
  }
  return {};
}

PlyTable PlyBody::view_of(const PlyElement& element) const {
  PlyTable table;
  table.rows = static_cast<std::size_t>(element.rows);
  const std::size_t stride = smallest_row(element, encoding_);
  const char* first = input_.content.data() + position_;
  table.lies_in_file = input_.content.substr(position_, table.rows * stride);
  for (const PlyProperty& property : element.properties) {
    table.columns.push_back({first, stride, loader(property.type, encoding_)});
    first += size_of(property.type);
  }
  return table;
}

Result<PlyTable> PlyBody::read_scalars(const PlyElement& element) {
  if (element.properties.empty()) return PlyTable{};
  const std::uint64_t fit = rows_that_fit(element);
  if (encoding_ != PlyEncoding::ascii && !element.has_lists()) {
    if (fit < element.rows) return ends_after(element, fit);
    PlyTable table = view_of(element);
    position_ += table.rows * smallest_row(element, encoding_);
    return table;
  }
  PlyTable table;
  table.rows = static_cast<std::size_t>(element.rows);
  const auto scalars = static_cast<std::size_t>(std::ranges::count(element.properties, false, &PlyProperty::is_list));
  table.decoded.reserve(static_cast<std::size_t>(fit) * scalars);
  CollectScalars visitor{table.decoded};
  ASBUILT_CHECK(walk(element, visitor));
  const char* first = reinterpret_cast<const char*>(table.decoded.data());
  for (const PlyProperty& property : element.properties) {
    if (property.is_list()) {
      table.columns.push_back({});
      continue;
    }
    table.columns.push_back({first, scalars * sizeof(double), scalar_loader<double, std::endian::native>()});
    if (table.rows > 0) first += sizeof(double);  // without rows there is nothing to point into
  }
  return table;
}

Result<PlyLists> PlyBody::read_lists(const PlyElement& element, std::size_t property) {
  PlyLists lists;
  CollectList visitor{property, lists};
  ASBUILT_CHECK(walk(element, visitor));
  return lists;
}

Result<void> PlyBody::skip(const PlyElement& element) {
  SkipRows visitor;
  if (encoding_ == PlyEncoding::ascii || element.has_lists() || element.properties.empty())
    return walk(element, visitor);
  if (const std::uint64_t fit = rows_that_fit(element); fit < element.rows) return ends_after(element, fit);
  position_ += static_cast<std::size_t>(element.rows) * smallest_row(element, encoding_);
  return {};
}

}  // namespace asbuilt::io
