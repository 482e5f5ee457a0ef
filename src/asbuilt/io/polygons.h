// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace asbuilt::io {

/// Most vertices a TriangleMesh can index.
constexpr std::size_t kMostVertices = 0x7fffffff;

/// Appends the fan of triangles around the first corner; none for fewer than three corners.
/// The corner that names no vertex, if there is one; then nothing is appended.
[[nodiscard]] inline std::optional<std::int64_t> append_fan(std::span<const std::int64_t> corners,
                                                            std::size_t vertex_count,
                                                            std::vector<Eigen::Vector3i>& triangles) {
  for (const std::int64_t corner : corners) {
    if (corner < 0 || static_cast<std::uint64_t>(corner) >= vertex_count) return corner;
  }
  for (std::size_t i = 2; i < corners.size(); ++i) {
    triangles.emplace_back(static_cast<int>(corners[0]), static_cast<int>(corners[i - 1]),
                           static_cast<int>(corners[i]));
  }
  return std::nullopt;
}

}  // namespace asbuilt::io
