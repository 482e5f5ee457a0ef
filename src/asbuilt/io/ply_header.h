// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

enum class PlyEncoding { ascii, binary_little_endian, binary_big_endian };

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

[[nodiscard]] std::size_t size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;         ///< of the value, or of each entry of a list
  std::optional<PlyType> list_count_type;  ///< set for a list; an integer type

  [[nodiscard]] bool is_list() const { return list_count_type.has_value(); }
};

struct PlyElement {
  std::string name;
  std::uint64_t rows = 0;  ///< as declared; the body may hold fewer
  std::vector<PlyProperty> properties;

  [[nodiscard]] bool has_lists() const;
  /// Index of the property whose name is `name` but for its case.
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;
};

/// What the head of a PLY file declares. Invariant: names and counts are as declared, nothing is checked against the
/// body.
struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::size_t body_begin = 0;  ///< byte after the line end_header
  std::size_t lines = 0;       ///< lines of the header

  [[nodiscard]] std::optional<std::size_t> find_element(std::string_view name) const;
};

/// Errors: unreadable_input with the line.
[[nodiscard]] Result<PlyHeader> read_ply_header(const Input& input);

/// "ascii", "binary_little_endian" or "binary_big_endian".
[[nodiscard]] std::string_view name_of(PlyEncoding encoding);

}  // namespace asbuilt::io
