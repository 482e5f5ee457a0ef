// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace asbuilt {

/// Points in millimetres, in the frame that the variable's name tells.
/// Invariant: `normals` is empty or as long as `positions`; normals are unit length.
struct PointCloud {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  [[nodiscard]] bool empty() const { return positions.empty(); }
  [[nodiscard]] bool has_normals() const { return !normals.empty(); }
};

}  // namespace asbuilt
