// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "asbuilt/simulate/implicit_mesh.h"
#include "asbuilt/simulate/parts.h"

/// Parts for tests (link asbuilt::simulate) and what can be asked of a mesh.
namespace asbuilt::test {

/// A rich casting without symmetry, coarse enough for quick tests.
inline TriangleMesh casing() { return simulate::valve_body(7.0); }

/// 120 mm long, 28 triangles, without symmetry.
inline TriangleMesh stepped_block() { return simulate::stepped_block(120.0); }

/// 200 mm across, six bolt holes: a six-fold axis.
inline TriangleMesh flange() { return simulate::flange(100.0, 16.0, 6, 5.0); }

/// A flange of radius 100 mm with a hub and six holes of radius 14 mm, of which the one on the x axis has its own
/// radius: six-fold if that is 14, too, else without symmetry, but nearly six-fold.
inline TriangleMesh flange_with_odd_hole(double odd_radius_mm) {
  const simulate::Solid solid = [=](const Eigen::Vector3d& p) {
    const double across = p.head<2>().norm();
    double value = std::max({across - 100.0, -p.z(), p.z() - 30.0});
    value = std::min(value, std::max({across - 45.0, -p.z(), p.z() - 60.0}));
    for (int i = 0; i < 6; ++i) {
      const double angle = std::numbers::pi * i / 3.0;
      const Eigen::Vector2d centre(75.0 * std::cos(angle), 75.0 * std::sin(angle));
      value = std::max(value, (i == 0 ? odd_radius_mm : 14.0) - (p.head<2>() - centre).norm());
    }
    return value;
  };
  return simulate::surface_of(solid, {Eigen::Vector3d(-100, -100, 0), Eigen::Vector3d(100, 100, 60)}, 4.0);
}

/// A square plate of 100 mm with a notch in the middle of each side, all 12 mm deep but the one on +x. With 12 there,
/// too, it has eight rotations; else a half turn about the x axis, and is nearly four-fold about z.
inline TriangleMesh notched_plate(double odd_depth_mm, double thickness_mm = 24.0) {
  std::vector<Eigen::Vector2d> outline;
  for (int side = 0; side < 4; ++side) {
    const double angle = std::numbers::pi / 2 * side, depth = side == 0 ? odd_depth_mm : 12.0;
    const Eigen::Vector2d out(std::cos(angle), std::sin(angle)), along(-std::sin(angle), std::cos(angle));
    outline.emplace_back(50.0 * out - 50.0 * along);
    outline.emplace_back(50.0 * out - 12.0 * along);
    outline.emplace_back((50.0 - depth) * out - 12.0 * along);
    outline.emplace_back((50.0 - depth) * out + 12.0 * along);
    outline.emplace_back(50.0 * out + 12.0 * along);
  }
  return simulate::extruded(outline, thickness_mm);
}

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
