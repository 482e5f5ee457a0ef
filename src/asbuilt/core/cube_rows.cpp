// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/cube_rows.h"

#include <Eigen/Geometry>
#include <cmath>

#include "asbuilt/core/result.h"

namespace asbuilt {
namespace {

constexpr double kMostCubes = 1 << 24;

double cubes_in(const Eigen::Vector3d& sizes, double cube_mm) { return ((sizes / cube_mm).array() + 1.0).prod(); }

}  // namespace

CubeRows::CubeRows(std::span<const Eigen::Vector3f> points, double cube_mm) {
  ASBUILT_EXPECT(cube_mm > 0.0, "cubes with an edge");
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& point : points) {
    if (point.allFinite()) box.extend(point);
  }
  if (box.isEmpty()) {
    starts_.assign(2, 0);
    return;
  }
  origin_ = box.min();
  const Eigen::Vector3d sizes = box.sizes().cast<double>();
  while (cubes_in(sizes, cube_mm) > kMostCubes) cube_mm *= 1.26;
  cubes_per_mm_ = static_cast<float>(1.0 / cube_mm);
  counts_ = (sizes / cube_mm).array().floor().cast<int>() + 1;

  starts_.assign(static_cast<std::size_t>(counts_.cast<std::int64_t>().prod()) + 2, 0);
  std::size_t finite = 0;
  for (const Eigen::Vector3f& point : points) {
    if (!point.allFinite()) continue;
    ++starts_[cube_of(point) + 2];
    ++finite;
  }
  for (std::size_t i = 2; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  order_.resize(finite);
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    if (points[i].allFinite()) order_[starts_[cube_of(points[i]) + 1]++] = i;  // afterwards where the next cube starts
  }
  starts_.pop_back();
}

std::size_t CubeRows::cube_of(const Eigen::Vector3f& point) const {
  const Eigen::Array3i cell = ((point - origin_).array() * cubes_per_mm_).cast<int>().min(counts_ - 1);
  return cube(cell.x(), cell.y(), cell.z());
}

}  // namespace asbuilt
