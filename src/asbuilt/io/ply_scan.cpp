// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "asbuilt/io/ply_body.h"
#include "asbuilt/io/ply_header.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scan_assembly.h"

namespace asbuilt::io {
namespace {

using Columns = std::array<StridedColumn, 3>;

/// The three columns of these names, if all are there and none is a list.
std::optional<Columns> columns_named(const PlyElement& element, const PlyTable& table,
                                     const std::array<std::string_view, 3>& names) {
  Columns columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto index = element.find(names[axis]);
    if (!index || element.properties[*index].is_list()) return std::nullopt;
    columns[axis] = table.columns[*index];
  }
  return columns;
}

std::optional<Columns> normal_columns(const PlyElement& element, const PlyTable& table) {
  if (auto columns = columns_named(element, table, {"nx", "ny", "nz"})) return columns;
  return columns_named(element, table, {"normal_x", "normal_y", "normal_z"});
}

/// Colours as bytes; reals are shares of 1, as some writers have them, and 16 bits are cut to 8.
PointValues<Rgb> colours_in(const PlyElement& element, const PlyTable& table) {
  auto columns = columns_named(element, table, {"red", "green", "blue"});
  std::string_view name = "red";
  if (!columns)
    columns = columns_named(element, table, {"diffuse_red", "diffuse_green", "diffuse_blue"}), name = "diffuse_red";
  if (!columns) return {};
  const PlyType type = element.properties[*element.find(name)].type;
  const bool is_share = type == PlyType::float32 || type == PlyType::float64;
  const double factor = is_share ? 255.0 : type == PlyType::uint16 ? 1.0 / 257.0 : 1.0;
  return [columns = *columns, factor](std::size_t first, std::span<Rgb> out) {
    std::array<double, kPointsAtOnce> numbers;
    for (std::size_t c = 0; c < 3; ++c) {
      columns[c].read(first, out.size(), numbers.data(), 1);
      for (std::size_t i = 0; i < out.size(); ++i) out[i][c] = nearest_byte(numbers[i] * factor);
    }
  };
}

/// A sentence when what follows the vertices is damaged: a scan does not need it, but its reader should know.
std::vector<std::string> notes_on_the_rest(PlyBody& body, const PlyHeader& header, std::size_t next_element) {
  for (std::size_t e = next_element; e < header.elements.size(); ++e) {
    if (const auto skipped = body.skip(header.elements[e]); !skipped) {
      return {fmt::format("The points are complete, what follows them is not: {}.", skipped.error().message)};
    }
  }
  std::vector<std::string> notes;
  if (header.encoding == PlyEncoding::ascii && body.last_line_is_open()) {
    notes.emplace_back("The last line has no line end: its last value may have been cut off.");
  }
  if (header.encoding != PlyEncoding::ascii && body.bytes_left() > 0) {
    notes.push_back(fmt::format("{} bytes follow the last element; they were ignored.", body.bytes_left()));
  }
  return notes;
}

}  // namespace

Result<std::vector<ScanFile>> read_ply_scan(const std::filesystem::path& path, const Input& input,
                                            const ReadOptions& options) {
  ASBUILT_TRY(header, read_ply_header(input));
  const auto vertex = header.find_element("vertex");
  if (!vertex) return input.error("the PLY header declares no element 'vertex'");
  const PlyElement& element = header.elements[*vertex];
  if (element.rows == 0) return input.error("the PLY header declares 0 vertices, expected points");

  PlyBody body(input, header);
  for (std::size_t e = 0; e < *vertex; ++e) ASBUILT_CHECK(body.skip(header.elements[e]));
  ASBUILT_TRY(table, body.read_scalars(element));
  const auto positions = columns_named(element, table, {"x", "y", "z"});
  if (!positions) return input.error("the vertices have no properties x, y and z");

  RawPoints points;
  points.count = table.rows;
  points.rows = table.lies_in_file;
  points.positions = positions_in(*positions);
  if (const auto normals = normal_columns(element, table)) points.normals = normals_in(*normals);
  points.colours = colours_in(element, table);
  for (const std::string_view name : {"intensity", "scalar_intensity", "scalar_Intensity"}) {
    const auto index = element.find(name);
    if (!index || element.properties[*index].is_list()) continue;
    points.intensities = intensities_in(table.columns[*index]);
  }
  ScanFile scan = assemble_scan(path, fmt::format("ply {}", name_of(header.encoding)), points, options);
  std::ranges::move(notes_on_the_rest(body, header, *vertex + 1), std::back_inserter(scan.notes));
  return std::vector<ScanFile>{std::move(scan)};
}

}  // namespace asbuilt::io
