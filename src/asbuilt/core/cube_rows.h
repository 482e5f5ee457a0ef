// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace asbuilt {

/// Points sorted into the cubes of a dense grid, in linear time: tens of millions of points in a second, and
/// neighbourhoods as a few ranges. For points that fill their box as surfaces do; a grid of more than 2^24 cubes is
/// made of larger ones.
class CubeRows {
 public:
  /// Points that are not finite are left out.
  CubeRows(std::span<const Eigen::Vector3f> points, double cube_mm);

  /// Indices of the points, cube by cube (x fastest), ascending within a cube: neighbours in space are neighbours here.
  [[nodiscard]] std::span<const std::uint32_t> order() const { return order_; }

  /// Calls visit(begin, end) with the ranges of order() that hold all points no further than `radius` from `centre`,
  /// and others.
  template <class Visit>
  void around(const Eigen::Vector3f& centre, float radius, const Visit& visit) const {
    const Eigen::Array3f low = (centre.array() - radius - origin_.array()) * cubes_per_mm_;
    const Eigen::Array3f high = (centre.array() + radius - origin_.array()) * cubes_per_mm_;
    if ((high < 0.0F).any() || (low >= counts_.cast<float>()).any()) return;
    const Eigen::Array3i first = low.max(0.0F).cast<int>();
    const Eigen::Array3i last = high.min((counts_ - 1).cast<float>()).cast<int>();
    for (int z = first.z(); z <= last.z(); ++z) {
      for (int y = first.y(); y <= last.y(); ++y) {
        const std::size_t begin = starts_[cube(first.x(), y, z)], end = starts_[cube(last.x(), y, z) + 1];
        if (begin < end) visit(begin, end);
      }
    }
  }

 private:
  [[nodiscard]] std::size_t cube(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(counts_.y()) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(counts_.x()) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] std::size_t cube_of(const Eigen::Vector3f& point) const;

  Eigen::Vector3f origin_ = Eigen::Vector3f::Zero();
  float cubes_per_mm_ = 1.0F;
  Eigen::Array3i counts_ = Eigen::Array3i::Ones();
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> starts_;  // of each cube in order_; one more at the end
};

/// End of a run of points, neighbours in space, that begins with point `begin`: at most `most` of them, and their box's
/// diagonal at most `widest`. `point_at(k)` tells the place of the k-th; one point is always a run.
template <class Scalar, class PointAt>
[[nodiscard]] std::size_t end_of_run(std::size_t begin, std::size_t end, std::size_t most, Scalar widest,
                                     const PointAt& point_at) {
  Eigen::AlignedBox<Scalar, 3> box(point_at(begin));
  std::size_t at = begin + 1;
  for (; at < std::min(end, begin + most); ++at) {
    box.extend(point_at(at));
    if (box.diagonal().squaredNorm() > widest * widest) break;
  }
  return at;
}

}  // namespace asbuilt
