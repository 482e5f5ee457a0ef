// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/scan_assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace asbuilt::io {

Eigen::Vector3d precision_offset_mm(const RawPoints& points, double mm_per_unit) {
  constexpr double kLargestKept_mm = 65536.0;
  constexpr double kStep_mm = 1000.0;
  constexpr std::size_t kProbes = 1001;
  std::vector<double> values[3];
  // Probes at even distances over the index range: the same for the same file, whatever it holds.
  for (std::size_t k = 0; k < std::min(kProbes, points.count); ++k) {
    const std::size_t index = points.count <= kProbes ? k : k * (points.count - 1) / (kProbes - 1);
    const Eigen::Vector3d position = points.position(index) * mm_per_unit;
    if (!position.allFinite() || position.isZero(0.0)) continue;
    for (int axis = 0; axis < 3; ++axis) values[axis].push_back(position[axis]);
  }
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3 && !values[axis].empty(); ++axis) {
    const auto middle = values[axis].begin() + static_cast<std::ptrdiff_t>(values[axis].size() / 2);
    std::nth_element(values[axis].begin(), middle, values[axis].end());
    if (std::abs(*middle) > kLargestKept_mm) offset[axis] = std::round(*middle / kStep_mm) * kStep_mm;
  }
  return offset;
}

ScanFile assemble_scan(const std::filesystem::path& path, std::string format, const RawPoints& points, Unit unit) {
  ScanFile scan;
  scan.path = path;
  scan.name = path.stem().string();
  scan.format = std::move(format);
  const double mm_per_unit = millimetres_per(unit);
  scan.offset_mm = precision_offset_mm(points, mm_per_unit);
  const bool moved = !scan.offset_mm.isZero(0.0);

  std::size_t no_returns = 0;
  scan.cloud.positions.reserve(points.count);
  for (std::size_t i = 0; i < points.count; ++i) {
    const Eigen::Vector3d position = points.position(i);
    if (moved && position.isZero(0.0)) {
      scan.cloud.positions.push_back(Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
      ++no_returns;
      continue;
    }
    scan.cloud.positions.push_back((position * mm_per_unit - scan.offset_mm).cast<float>());
  }
  if (points.normal) {
    scan.cloud.normals.reserve(points.count);
    for (std::size_t i = 0; i < points.count; ++i) scan.cloud.normals.push_back(points.normal(i).cast<float>());
  }
  if (moved) {
    scan.notes.push_back(fmt::format("Large coordinates: the offset ({:.0f}, {:.0f}, {:.0f}) mm was taken off.",
                                     scan.offset_mm.x(), scan.offset_mm.y(), scan.offset_mm.z()));
  }
  if (no_returns > 0) {
    scan.notes.push_back(fmt::format("{} points at exactly (0, 0, 0) were taken for missing returns.", no_returns));
  }
  return scan;
}

}  // namespace asbuilt::io
