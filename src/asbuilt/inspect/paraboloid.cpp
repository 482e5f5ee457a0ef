// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/paraboloid.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "asbuilt/core/median.h"

namespace asbuilt::inspect {
namespace {

using Vector = Eigen::Matrix<double, 6, 1>;
using Matrix = Eigen::Matrix<double, 6, 6>;

constexpr double kOutlier = 3.5;      // robust sigmas
constexpr double kFurthestTop = 0.5;  // beyond, it is told from one side only

Vector row_of(const Eigen::Vector2d& p) { return {1.0, p.x(), p.y(), p.x() * p.x(), p.x() * p.y(), p.y() * p.y()}; }

Eigen::Vector2d top_of(const Vector& fit, double sign) {
  Eigen::Matrix2d bend;
  bend << 2.0 * fit[3], fit[4], fit[4], 2.0 * fit[5];
  const bool is_cap = -sign * bend(0, 0) > 0.0 && bend.determinant() > 1e-12 * bend.squaredNorm();
  if (!is_cap) return Eigen::Vector2d::Zero();
  const Eigen::Vector2d top = -bend.inverse() * fit.segment<2>(1);
  return top.norm() > kFurthestTop ? Eigen::Vector2d::Zero() : top;
}

}  // namespace

std::optional<Extremum> extremum_of_paraboloid(std::span<const Eigen::Vector3d> points, double sign) {
  if (points.empty()) return std::nullopt;
  Vector fit = Vector::Zero();
  Matrix covariance = Matrix::Zero();
  double scale = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 3; ++pass) {  // the later ones without what stands out
    Matrix information = Matrix::Zero();
    Vector moment = Vector::Zero();
    for (const Eigen::Vector3d& p : points) {
      const Vector row = row_of(p.head<2>());
      if (pass > 0 && std::abs(p.z() - row.dot(fit)) > kOutlier * scale) continue;
      information += row * row.transpose();
      moment += p.z() * row;
    }
    const auto solver = information.ldlt();
    if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-9)) return std::nullopt;
    fit = solver.solve(moment);
    std::vector<double> residuals;
    residuals.reserve(points.size());
    for (const Eigen::Vector3d& p : points) residuals.push_back(std::abs(p.z() - row_of(p.head<2>()).dot(fit)));
    scale = std::max(1.4826 * median_of(std::move(residuals)), 1e-9);
    covariance = solver.solve(Matrix::Identity()) * scale * scale;
  }
  const Eigen::Vector2d top = top_of(fit, sign);
  const Vector row = row_of(top);
  return Extremum{top, row.dot(fit), std::max(0.0, row.dot(covariance * row))};
}

}  // namespace asbuilt::inspect
