// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt::io {

/// One scalar property of the vertices of a PLY file; `values` must outlive the call.
struct PlyColumn {
  std::string name;
  std::variant<std::span<const float>, std::span<const double>, std::span<const std::uint8_t>,
               std::span<const std::uint16_t>, std::span<const std::int32_t>>
      values;
};

/// Writes a binary little-endian PLY of vertices with these columns, in this order, whole or not at all.
/// Precondition: all columns are equally long.
[[nodiscard]] Result<void> write_ply(const std::filesystem::path& path, std::span<const PlyColumn> columns,
                                     std::span<const std::string> comments = {});

/// The scalar vertex properties of a PLY file (any scalar type, any of its encodings), by name, as doubles.
struct PlyVertices {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;  ///< one per name, all equally long

  [[nodiscard]] const std::vector<double>* find(const std::string& name) const;  ///< nullptr if absent
};
[[nodiscard]] Result<PlyVertices> read_ply_vertices(const std::filesystem::path& path);

}  // namespace asbuilt::io
