// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>

#include "asbuilt/simulate/parts.h"

/// Parts for tests (link asbuilt::simulate) and what can be asked of a mesh.
namespace asbuilt::test {

/// A rich casting without symmetry, coarse enough for quick tests.
inline TriangleMesh casing() { return simulate::valve_body(7.0); }

/// 120 mm long, 28 triangles, without symmetry.
inline TriangleMesh stepped_block() { return simulate::stepped_block(120.0); }

/// 200 mm across, six bolt holes: a six-fold axis.
inline TriangleMesh flange() { return simulate::flange(100.0, 16.0, 6, 5.0); }

/// Whether every edge is used once in each direction: closed, two-sided, and wound alike throughout.
inline bool is_closed_manifold(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> uses;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++uses[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : uses) {
    const auto back = uses.find({edge.second, edge.first});
    if (count != 1 || back == uses.end() || back->second != 1) return false;
  }
  return !mesh.empty();
}

/// Positive for a closed mesh that is wound outwards, mm^3.
inline double volume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    sum += at(0).dot(at(1).cross(at(2))) / 6.0;
  }
  return sum;
}

}  // namespace asbuilt::test
