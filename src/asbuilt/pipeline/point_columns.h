// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace asbuilt::pipeline {

/// What a reconstruction.ply says of each point beside its place (docs/outputs.md). Each list is empty, where the file
/// says nothing, or has an entry a point.
struct PointColumns {
  std::vector<std::uint16_t> scan;     ///< the scan that contributed most
  std::vector<std::uint16_t> support;  ///< number of scans that saw it
  std::vector<float> sigma_mm;         ///< standard error along its normal

  /// The columns of the rows that are left, in their order.
  [[nodiscard]] PointColumns of_rows(std::span<const std::uint32_t> rows) const;
};

/// The columns `scan`, `support` and `sigma` of the vertices of a PLY file; nothing for another file, or for one that
/// cannot be read, as whoever reads its points will say. Numbers that are no count leave the column out.
[[nodiscard]] PointColumns point_columns(const std::string& path, std::string_view content, double mm_per_unit);

}  // namespace asbuilt::pipeline
