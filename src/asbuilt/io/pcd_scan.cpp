// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/lzf.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/pcd_header.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scalar_load.h"
#include "asbuilt/io/scan_assembly.h"

namespace asbuilt::io {
namespace {

/// The first value of every field. `storage` holds what the columns point to unless that is the file itself.
struct Body {
  std::vector<StridedColumn> columns;
  std::vector<double> numbers;
  std::string expanded;
  std::vector<std::string> notes;
};

ScalarLoader loader(const PcdField& field) {
  constexpr auto kLittle = std::endian::little;
  if (field.type == 'F') return field.size == 8 ? scalar_loader<double, kLittle>() : scalar_loader<float, kLittle>();
  const bool is_signed = field.type == 'I';
  switch (field.size) {
    case 1:
      return is_signed ? scalar_loader<std::int8_t, kLittle>() : scalar_loader<std::uint8_t, kLittle>();
    case 2:
      return is_signed ? scalar_loader<std::int16_t, kLittle>() : scalar_loader<std::uint16_t, kLittle>();
    case 4:
      return is_signed ? scalar_loader<std::int32_t, kLittle>() : scalar_loader<std::uint32_t, kLittle>();
    default:
      return is_signed ? scalar_loader<std::int64_t, kLittle>() : scalar_loader<std::uint64_t, kLittle>();
  }
}

std::string ends_after(std::uint64_t found, std::uint64_t declared) {
  return fmt::format("the file ends after {} of {} points, it seems to be truncated", found, declared);
}

/// Writers that map the file into memory leave zeros up to the end of a page; anything else is worth a word.
void note_rest(Body& body, std::string_view rest) {
  if (rest.find_first_not_of('\0') == std::string_view::npos) return;
  body.notes.push_back(fmt::format("{} bytes follow the last point; they were ignored.", rest.size()));
}

Result<Body> read_ascii(const Input& input, const PcdHeader& header) {
  Body body;
  LineCursor lines(input.content, header.body_begin, header.lines);
  const std::uint64_t fit = (input.content.size() - header.body_begin + 1) / (2 * header.point_values);
  body.numbers.reserve(static_cast<std::size_t>(std::min(fit, header.points)) * header.fields.size());
  for (std::uint64_t point = 0; point < header.points; ++point) {
    if (!lines.next_with_content()) return input.error_at_line(lines.number() + 1, ends_after(point, header.points));
    WordCursor words(lines.line());
    std::size_t found = 0;
    for (const PcdField& field : header.fields) {
      for (std::size_t i = 0; i < field.count; ++i, ++found) {
        const std::string_view word = words.next();
        if (word.empty()) {
          return input.error_at_line(lines.number(), fmt::format("the point has {} values, the header declares {}",
                                                                 found, header.point_values));
        }
        const auto number = parse_number(word);
        if (!number)
          return input.error_at_line(lines.number(), fmt::format("found {}, expected a number", in_quotes(word)));
        if (i == 0) body.numbers.push_back(*number);
      }
    }
    if (!words.rest().empty()) {
      return input.error_at_line(
          lines.number(),
          fmt::format("the point has more than the {} values the header declares", header.point_values));
    }
  }
  if (!lines.is_ended()) {
    body.notes.emplace_back("The last line has no line end: its last value may have been cut off.");
  }
  const char* first = reinterpret_cast<const char*>(body.numbers.data());
  for (std::size_t f = 0; f < header.fields.size(); ++f, first += sizeof(double)) {
    body.columns.push_back(
        {first, header.fields.size() * sizeof(double), scalar_loader<double, std::endian::native>()});
  }
  return body;
}

Result<Body> read_binary(const Input& input, const PcdHeader& header) {
  const std::size_t present = input.content.size() - header.body_begin;
  if (const std::uint64_t fit = present / header.point_size; fit < header.points) {
    return input.error_at_byte(input.content.size(), ends_after(fit, header.points));
  }
  Body body;
  const char* first = input.content.data() + header.body_begin;
  for (const PcdField& field : header.fields) {
    body.columns.push_back({first, header.point_size, loader(field)});
    first += field.size * field.count;
  }
  note_rest(body,
            input.content.substr(header.body_begin + static_cast<std::size_t>(header.points) * header.point_size));
  return body;
}

/// The sizes before and after compression, the LZF stream, and in it one array after the other, a field each.
Result<Body> read_compressed(const Input& input, const PcdHeader& header) {
  const std::string_view bytes = input.content.substr(header.body_begin);
  if (bytes.size() < 8) return input.error_at_byte(input.content.size(), "the file ends before the compressed points");
  const auto load = load_scalar<std::uint32_t, std::endian::little>;
  const auto compressed = static_cast<std::size_t>(load(bytes.data()));
  const auto expanded = static_cast<std::size_t>(load(bytes.data() + 4));
  if (bytes.size() - 8 < compressed) {
    return input.error_at_byte(
        input.content.size(),
        fmt::format("the file ends after {} of {} bytes of compressed points, 0 of {} points can be "
                    "read, it seems to be truncated",
                    bytes.size() - 8, compressed, header.points));
  }
  if (header.points > expanded / header.point_size || header.points * header.point_size != expanded) {
    return input.error_at_byte(header.body_begin + 4,
                               fmt::format("{} bytes of expanded points are declared, expected {} points of {} bytes",
                                           expanded, header.points, header.point_size));
  }
  if (expanded > lzf_largest_expansion(compressed)) {
    return input.error_at_byte(header.body_begin + 4,
                               fmt::format("{} bytes can never expand to {}", compressed, expanded));
  }
  Body body;
  auto content = lzf_expand(bytes.substr(8, compressed), expanded);
  if (!content) return input.error_at_byte(header.body_begin + 8, "the compressed points are damaged");
  body.expanded = std::move(*content);
  const char* first = body.expanded.data();
  for (const PcdField& field : header.fields) {
    const std::size_t stride = field.size * field.count;
    body.columns.push_back({first, stride, loader(field)});
    first += stride * static_cast<std::size_t>(header.points);
  }
  note_rest(body, bytes.substr(8 + compressed));
  return body;
}

Result<Body> read_body(const Input& input, const PcdHeader& header) {
  switch (header.encoding) {
    case PcdEncoding::ascii:
      return read_ascii(input, header);
    case PcdEncoding::binary:
      return read_binary(input, header);
    case PcdEncoding::binary_compressed:
      return read_compressed(input, header);
  }
  throw std::logic_error("asbuilt: expected a PCD encoding");
}

using Names = std::array<std::string_view, 3>;

/// The three columns of these names, if all are there.
std::optional<std::array<StridedColumn, 3>> columns_named(const PcdHeader& header, const Body& body,
                                                          const Names& names) {
  std::array<StridedColumn, 3> columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto field = header.find(names[axis]);
    if (!field) return std::nullopt;
    columns[axis] = body.columns[*field];
  }
  return columns;
}

/// PCL packs a colour into the bits of one number, 0x00RRGGBB, which the file may call a float.
PointValues<Rgb> colours_of(const PcdHeader& header, const Body& body) {
  auto field = header.find("rgb");
  if (!field) field = header.find("rgba");
  if (!field || header.fields[*field].size != 4) return {};
  const bool is_real = header.fields[*field].type == 'F';
  return values_by_row<Rgb>([column = body.columns[*field], is_real](std::size_t i) {
    const double value = column[i];
    std::uint32_t bits = 0;
    if (is_real) {
      bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
    } else if (value >= 0.0 && value <= 4294967295.0) {
      bits = static_cast<std::uint32_t>(value);
    }
    return Rgb{static_cast<std::uint8_t>(bits >> 16), static_cast<std::uint8_t>(bits >> 8),
               static_cast<std::uint8_t>(bits)};
  });
}

/// The sensor's place, unless the header has the default pose, which most writers put there without knowing better.
std::optional<Eigen::Vector3d> viewpoint_of(const PcdHeader& header) {
  if (header.viewpoint == std::array<double, 7>{0, 0, 0, 1, 0, 0, 0}) return std::nullopt;
  return Eigen::Vector3d(header.viewpoint[0], header.viewpoint[1], header.viewpoint[2]);
}

}  // namespace

Result<std::vector<ScanFile>> read_pcd_scan(const std::filesystem::path& path, const Input& input,
                                            const ReadOptions& options) {
  ASBUILT_TRY(header, read_pcd_header(input));
  for (const std::string_view name : {"x", "y", "z"}) {
    if (!header.find(name)) return input.error(fmt::format("the PCD header declares no field {}", name));
  }
  if (header.points == 0) return input.error("the PCD header declares 0 points");
  ASBUILT_TRY(body, read_body(input, header));

  RawPoints points;
  points.count = static_cast<std::size_t>(header.points);
  if (header.encoding == PcdEncoding::binary) {
    points.rows = input.content.substr(header.body_begin, points.count * header.point_size);
  }
  points.positions = positions_in(*columns_named(header, body, {"x", "y", "z"}));
  auto normals = columns_named(header, body, {"normal_x", "normal_y", "normal_z"});
  if (!normals) normals = columns_named(header, body, {"nx", "ny", "nz"});
  if (normals) points.normals = normals_in(*normals);
  points.colours = colours_of(header, body);
  if (const auto field = header.find("intensity")) points.intensities = intensities_in(body.columns[*field]);
  ScanFile scan = assemble_scan(path, fmt::format("pcd {}", name_of(header.encoding)), points, options);
  if (header.height > 1) scan.grid = ScanGrid{header.height, header.width};
  std::ranges::move(body.notes, std::back_inserter(scan.notes));
  if (const auto viewpoint = viewpoint_of(header)) {
    if (viewpoint->allFinite())
      scan.viewpoint_mm = *viewpoint * millimetres_per(options.unit);
    else
      scan.notes.emplace_back("The VIEWPOINT of the header is not finite and was ignored.");
  }
  return std::vector<ScanFile>{std::move(scan)};
}

}  // namespace asbuilt::io
