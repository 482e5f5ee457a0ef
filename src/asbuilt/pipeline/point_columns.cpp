// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/point_columns.h"

#include <cmath>
#include <limits>
#include <optional>

#include "asbuilt/io/ply_body.h"
#include "asbuilt/io/ply_header.h"

namespace asbuilt::pipeline {
namespace {

template <class T>
std::vector<T> rows_of(const std::vector<T>& column, std::span<const std::uint32_t> rows) {
  std::vector<T> kept;
  if (column.empty()) return kept;
  kept.reserve(rows.size());
  for (const std::uint32_t row : rows) kept.push_back(column[row]);
  return kept;
}

std::optional<io::StridedColumn> column_named(const io::PlyElement& element, const io::PlyTable& table,
                                              std::string_view name) {
  const auto index = element.find(name);
  if (!index || element.properties[*index].is_list()) return std::nullopt;
  return table.columns[*index];
}

std::vector<std::uint16_t> counts_in(const std::optional<io::StridedColumn>& column, std::size_t rows) {
  std::vector<std::uint16_t> counts;
  if (!column) return counts;
  counts.reserve(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const double value = (*column)[row];
    if (!(value >= 0.0 && value <= std::numeric_limits<std::uint16_t>::max() && std::floor(value) == value)) return {};
    counts.push_back(static_cast<std::uint16_t>(value));
  }
  return counts;
}

std::vector<float> lengths_in(const std::optional<io::StridedColumn>& column, std::size_t rows, double mm_per_unit) {
  std::vector<float> lengths;
  if (!column) return lengths;
  lengths.reserve(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const double value = (*column)[row] * mm_per_unit;
    lengths.push_back(value >= 0.0 && std::isfinite(value) ? static_cast<float>(value) : 0.0F);  // 0: unknown
  }
  return lengths;
}

}  // namespace

PointColumns PointColumns::of_rows(std::span<const std::uint32_t> rows) const {
  return {rows_of(scan, rows), rows_of(support, rows), rows_of(sigma_mm, rows)};
}

PointColumns point_columns(const std::string& path, std::string_view content, double mm_per_unit) {
  if (!content.starts_with("ply")) return {};
  const io::Input input{path, content};
  const auto header = io::read_ply_header(input);
  if (!header) return {};
  const auto vertex = header->find_element("vertex");
  if (!vertex) return {};
  const io::PlyElement& element = header->elements[*vertex];
  if (!element.find("scan") && !element.find("support") && !element.find("sigma")) return {};
  io::PlyBody body(input, *header);
  for (std::size_t e = 0; e < *vertex; ++e) {
    if (!body.skip(header->elements[e])) return {};
  }
  const auto table = body.read_scalars(element);
  if (!table) return {};
  return {counts_in(column_named(element, *table, "scan"), table->rows),
          counts_in(column_named(element, *table, "support"), table->rows),
          lengths_in(column_named(element, *table, "sigma"), table->rows, mm_per_unit)};
}

}  // namespace asbuilt::pipeline
