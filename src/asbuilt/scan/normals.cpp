// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/normals.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::scan {
namespace {

constexpr std::size_t kQuadricNeighbours = 20;
constexpr int kQuadricUnknowns = 6;

// Root mean square residual of height = quadratic polynomial over the tangent plane, corrected for the unknowns.
double quadric_residual(std::span<const Eigen::Vector3f> points, std::span<const KdTree::Neighbour> neighbours) {
  const Eigen::Vector3d normal = fit_plane(points, neighbours).normal.cast<double>();
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);
  const Eigen::Vector3d centre = points[neighbours.front().index].cast<double>();
  const double reach = std::sqrt(static_cast<double>(neighbours.back().squared_distance));
  if (!(reach > 0.0)) return 0.0;

  Eigen::Matrix<double, kQuadricUnknowns, kQuadricUnknowns> system;
  Eigen::Matrix<double, kQuadricUnknowns, 1> right = Eigen::Matrix<double, kQuadricUnknowns, 1>::Zero();
  system.setZero();
  double heights_squared = 0.0;
  for (const KdTree::Neighbour& neighbour : neighbours) {
    const Eigen::Vector3d offset = (points[neighbour.index].cast<double>() - centre) / reach;
    const double x = offset.dot(u), y = offset.dot(v), height = offset.dot(normal);
    const Eigen::Matrix<double, kQuadricUnknowns, 1> row{1.0, x, y, x * x, x * y, y * y};
    system += row * row.transpose();
    right += row * height;
    heights_squared += height * height;
  }
  const Eigen::Matrix<double, kQuadricUnknowns, 1> solution = system.ldlt().solve(right);
  const double squared = std::max(0.0, heights_squared - right.dot(solution));
  const double freedom = static_cast<double>(neighbours.size()) - kQuadricUnknowns;
  return reach * std::sqrt(squared / freedom);
}

}  // namespace

PlaneFit fit_plane(std::span<const Eigen::Vector3f> points, std::span<const KdTree::Neighbour> neighbours) {
  if (neighbours.size() < 3) return {};
  const Eigen::Vector3f origin = points[neighbours.front().index];  // keeps the sums small against the coordinates
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  for (const KdTree::Neighbour& neighbour : neighbours) {
    const Eigen::Vector3d p = (points[neighbour.index] - origin).cast<double>();
    sum += p;
    xx += p.x() * p.x(), xy += p.x() * p.y(), xz += p.x() * p.z();
    yy += p.y() * p.y(), yz += p.y() * p.z(), zz += p.z() * p.z();
  }
  const double count = static_cast<double>(neighbours.size());
  Eigen::Matrix3d covariance;
  covariance << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  covariance = covariance / count - (sum / count) * (sum / count).transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance);
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  if (!normal.allFinite()) return {};
  const double sum_of_all = solver.eigenvalues().sum();
  const double variation = sum_of_all > 0.0 ? std::max(0.0, solver.eigenvalues()[0]) / sum_of_all : 1.0;
  return {normal.normalized().cast<float>(), static_cast<float>(variation)};
}

FittedNormals fitted_normals(std::span<const Eigen::Vector3f> points, const KdTree& tree, std::size_t count,
                             const Context& context) {
  FittedNormals fitted;
  fitted.normals.resize(points.size());
  fitted.variation.resize(points.size());
  parallel_for_blocks(context, points.size(), 1024, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      tree.nearest(points[i], count, neighbours);
      const PlaneFit plane = fit_plane(points, neighbours);
      fitted.normals[i] = plane.normal;
      fitted.variation[i] = plane.variation;
    }
  });
  return fitted;
}

double estimate_noise(std::span<const Eigen::Vector3f> points, const KdTree& tree, const Context& context,
                      std::size_t max_probes) {
  if (points.size() < kQuadricNeighbours) return 0.0;
  const std::size_t probes = std::min(max_probes, points.size());
  std::vector<double> residuals(probes);
  parallel_for_blocks(context, probes, 64, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      tree.nearest(points[i * points.size() / probes], kQuadricNeighbours, neighbours);
      residuals[i] = quadric_residual(points, neighbours);
    }
  });
  return median_of(std::move(residuals));
}

std::size_t neighbours_for_normals(double noise_sigma_mm, double spacing_mm) {
  // n = pi r^2 / s^2 points in radius r; the slope of their plane has sigma_slope = 2 sigma / (r sqrt(n)).
  constexpr double kSlope = 0.05;  // about 3 degrees
  constexpr std::size_t kLeast = 12, kMost = 60;
  if (!(spacing_mm > 0.0)) return kLeast;
  const double wanted = 2.0 * std::sqrt(std::numbers::pi) * noise_sigma_mm / (kSlope * spacing_mm);
  return std::clamp(static_cast<std::size_t>(std::ceil(std::min(wanted, 1e6))), kLeast, kMost);
}

}  // namespace asbuilt::scan
