// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "asbuilt/core/random.h"
#include "asbuilt/simulate/mesh_edit.h"

namespace asbuilt::test {

/// Points that lie on a surface, uniform by area.
inline std::vector<Eigen::Vector3d> surface_points(const TriangleMesh& mesh, std::size_t count) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& sample : simulate::area_samples(mesh, count, Random(1, "test", 0)))
    points.push_back(sample.position);
  return points;
}

}  // namespace asbuilt::test
