// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/shared_cells.h"

#include <cmath>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/pose.h"

namespace asbuilt::graph {
namespace {

constexpr double kRounding = 1e-9;  // of the cells: an eigenvalue below is zero

}  // namespace

void SharedCells::add(const Cell& cell) {
  Moments& moments = by_axis_[static_cast<std::size_t>(cell.side / 2)];
  const std::int64_t x = cell.voxel.x(), y = cell.voxel.y(), z = cell.voxel.z();
  ++moments.cells;
  moments.positions[0] += x;
  moments.positions[1] += y;
  moments.positions[2] += z;
  const std::array<std::int64_t, 6> products{x * x, x * y, x * z, y * y, y * z, z * z};
  for (std::size_t i = 0; i < products.size(); ++i) moments.products[i] += products[i];
}

std::int64_t SharedCells::count() const { return by_axis_[0].cells + by_axis_[1].cells + by_axis_[2].cells; }

double SharedCells::firmness() const {
  const auto all = static_cast<double>(count());
  if (all < 1.0) return 0.0;
  const auto sum_of = [](const Moments& m) {
    return Eigen::Vector3d(static_cast<double>(m.positions[0]), static_cast<double>(m.positions[1]),
                           static_cast<double>(m.positions[2]));
  };
  const Eigen::Vector3d centre = (sum_of(by_axis_[0]) + sum_of(by_axis_[1]) + sum_of(by_axis_[2])) / all;
  std::array<Eigen::Matrix3d, 3> second;  // sum of (p - c) (p - c)^T
  std::array<Eigen::Vector3d, 3> first;   // sum of (p - c)
  double squares = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Moments& m = by_axis_[axis];
    const auto cells = static_cast<double>(m.cells);
    Eigen::Matrix3d raw;
    const auto product = [&](std::size_t i) { return static_cast<double>(m.products[i]); };
    raw << product(0), product(1), product(2), product(1), product(3), product(4), product(2), product(4), product(5);
    const Eigen::Vector3d sum = sum_of(m);
    first[axis] = sum - cells * centre;
    second[axis] = raw - sum * centre.transpose() - centre * sum.transpose() + cells * (centre * centre.transpose());
    squares += second[axis].trace();
  }
  const double radius = std::sqrt(squares / all);
  if (!(radius > 0.0)) return 0.0;

  Matrix6d information = Matrix6d::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d normal = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis));
    const Eigen::Matrix3d across = -cross_matrix(normal);  // takes p to p x n
    information.topLeftCorner<3, 3>() += across * second[axis] * across.transpose() / (radius * radius);
    information.topRightCorner<3, 3>() += across * first[axis] * normal.transpose() / radius;
    information(3 + static_cast<Eigen::Index>(axis), 3 + static_cast<Eigen::Index>(axis)) +=
        static_cast<double>(by_axis_[axis].cells);
  }
  information.bottomLeftCorner<3, 3>() = information.topRightCorner<3, 3>().transpose();
  const double least = SymmetricEigen<6>(information).eigenvalues()[0];
  return least > kRounding * all ? least : 0.0;
}

}  // namespace asbuilt::graph
