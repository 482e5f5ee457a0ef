// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/normals.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "asbuilt/core/cube_rows.h"
#include "asbuilt/core/matrix_factors.h"
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
  const Eigen::Matrix<double, kQuadricUnknowns, 1> solution = solve_symmetric(system, right);
  const double squared = std::max(0.0, heights_squared - right.dot(solution));
  const double freedom = static_cast<double>(neighbours.size()) - kQuadricUnknowns;
  return reach * std::sqrt(squared / freedom);
}

/// Sums over offsets from a point near by.
struct Moments {
  double count = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  void add(const Eigen::Vector3f& offset) {
    const Eigen::Vector3d p = offset.cast<double>();
    count += 1.0;
    sum += p;
    xx += p.x() * p.x(), xy += p.x() * p.y(), xz += p.x() * p.z();
    yy += p.y() * p.y(), yz += p.y() * p.z(), zz += p.z() * p.z();
  }
};

PlaneFit plane_of(const Moments& moments) {
  if (moments.count < 3.0) return {};
  Eigen::Matrix3d covariance;
  covariance << moments.xx, moments.xy, moments.xz, moments.xy, moments.yy, moments.yz, moments.xz, moments.yz,
      moments.zz;
  const Eigen::Vector3d mean = moments.sum / moments.count;
  covariance = covariance / moments.count - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance);
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  if (!normal.allFinite()) return {};
  const double sum_of_all = solver.eigenvalues().sum();
  const double variation = sum_of_all > 0.0 ? std::max(0.0, solver.eigenvalues()[0]) / sum_of_all : 1.0;
  return {normal.normalized().cast<float>(), static_cast<float>(variation)};
}

/// Points axis by axis, and their squared distances from somewhere.
struct Columns {
  std::vector<float> x, y, z, squared;

  void resize(std::size_t size) {
    for (std::vector<float>* column : {&x, &y, &z, &squared}) column->resize(size);
  }
  [[nodiscard]] std::size_t size() const { return squared.size(); }
};

/// The nearest points of each of a run of points that are neighbours in space: what any of them may need is gathered
/// once for all. The loops over all that was gathered have no branches.
class Neighbourhoods {
 public:
  /// `columns` holds the points in the order of `cubes`.
  Neighbourhoods(std::span<const Eigen::Vector3f> points, const Columns& columns, const CubeRows& cubes, float cube_mm,
                 const KdTree& tree, std::size_t count)
      : points_(points), columns_(columns), cubes_(cubes), cube_mm_(cube_mm), tree_(tree), count_(count) {}

  /// Gathers for a run that begins with the point at this place in the cubes' order, and says where it ends: it fits
  /// into a ball that is small beside the neighbourhoods.
  [[nodiscard]] std::size_t gather_run(std::size_t begin, std::size_t end) {
    constexpr std::size_t kMost = 32;
    const auto order = cubes_.order();
    if (reach_ == 0.0F) reach_ = reach_by_tree(points_[order[begin]]);
    const std::size_t at = end_of_run(begin, end, kMost, reach_, [&](std::size_t k) { return points_[order[k]]; });
    gather(order.subspan(begin, at - begin));
    return at;
  }

  /// Of the `count` nearest points, relative to a point of the run.
  [[nodiscard]] Moments moments_about(const Eigen::Vector3f& point) {
    const std::size_t near = keep_near(point);
    if (near < count_) return moments_by_tree(point);
    const float farthest = kth_smallest(std::span(near_.squared).first(near));
    reach_ = std::max(reach_, std::sqrt(farthest));
    constexpr std::size_t kLanes = 4;
    using Lanes = Eigen::Array<double, kLanes, 1>;
    const std::size_t padded = (near + kLanes - 1) / kLanes * kLanes;
    for (std::size_t k = near; k < padded; ++k) {
      near_.x[k] = near_.y[k] = near_.z[k] = 0.0F;
      near_.squared[k] = std::numeric_limits<float>::infinity();
    }
    std::array<Lanes, 10> sums;
    sums.fill(Lanes::Zero());
    for (std::size_t k = 0; k < padded; k += kLanes) {
      using Floats = Eigen::Map<const Eigen::Array<float, kLanes, 1>>;
      const Lanes taken = (Floats(&near_.squared[k]) <= farthest).cast<double>();
      const Lanes x = taken * Floats(&near_.x[k]).cast<double>();
      const Lanes y = taken * Floats(&near_.y[k]).cast<double>();
      const Lanes z = taken * Floats(&near_.z[k]).cast<double>();
      sums[0] += taken;
      sums[1] += x, sums[2] += y, sums[3] += z;
      sums[4] += x * x, sums[5] += x * y, sums[6] += x * z;
      sums[7] += y * y, sums[8] += y * z, sums[9] += z * z;
    }
    Moments moments{sums[0].sum(), {sums[1].sum(), sums[2].sum(), sums[3].sum()},
                    sums[4].sum(), sums[5].sum(),
                    sums[6].sum(), sums[7].sum(),
                    sums[8].sum(), sums[9].sum()};
    // Of equally far ones the tree knows which come first.
    return moments.count > static_cast<double>(count_) ? moments_by_tree(point) : moments;
  }

 private:
  static constexpr float kRoom = 1.12F;       // neighbourhoods of neighbours are about as large
  static constexpr float kMostCubes = 12.0F;  // across a reach: beyond, rows of empty cubes cost more than the tree

  void gather(std::span<const std::uint32_t> run) {
    Eigen::AlignedBox3f box;
    for (const std::uint32_t i : run) box.extend(points_[i]);
    const Eigen::Vector3f centre = box.center();
    float squared_radius = 0.0F;
    for (const std::uint32_t i : run) squared_radius = std::max(squared_radius, (points_[i] - centre).squaredNorm());
    const float radius = std::sqrt(squared_radius);
    gathered_reach_ = kRoom * reach_;
    reach_ = 0.0F;
    gathered_.resize(0);
    if (gathered_reach_ > kMostCubes * cube_mm_) return;
    const float whole = 1.0001F * (radius + gathered_reach_);  // rounding must not cost a point
    std::size_t kept = 0;
    cubes_.around(centre, whole, [&](std::size_t begin, std::size_t end) {
      gathered_.resize(kept + (end - begin));
      for (std::size_t k = begin; k < end; ++k) {
        const float x = columns_.x[k], y = columns_.y[k], z = columns_.z[k];
        const float dx = x - centre.x(), dy = y - centre.y(), dz = z - centre.z();
        gathered_.x[kept] = x, gathered_.y[kept] = y, gathered_.z[kept] = z;
        kept += dx * dx + dy * dy + dz * dz <= whole * whole ? 1 : 0;
      }
    });
    gathered_.resize(kept);
  }

  // Offsets and squared distances of those within the reach that was gathered for; says how many.
  std::size_t keep_near(const Eigen::Vector3f& point) {
    constexpr std::size_t kPadding = 4;
    const std::size_t size = gathered_.size();
    const float limit = gathered_reach_ * gathered_reach_;
    if (near_.size() < size + kPadding) near_.resize(size + kPadding);
    const float px = point.x(), py = point.y(), pz = point.z();
    std::size_t kept = 0;
    for (std::size_t k = 0; k < size; ++k) {
      const float dx = gathered_.x[k] - px, dy = gathered_.y[k] - py, dz = gathered_.z[k] - pz;
      const float squared = dx * dx + dy * dy + dz * dz;
      near_.x[kept] = dx, near_.y[kept] = dy, near_.z[kept] = dz, near_.squared[kept] = squared;
      kept += squared <= limit ? 1 : 0;
    }
    return kept;
  }

  // On a surface squared distances are spread evenly, so each bin holds but a few.
  [[nodiscard]] float kth_smallest(std::span<const float> squared) {
    constexpr std::size_t kBins = 64;
    std::array<std::uint32_t, kBins> counts{};
    const float bins_per_unit = static_cast<float>(kBins) / (gathered_reach_ * gathered_reach_);
    const auto bin_of = [&](float value) {
      return std::min(static_cast<std::size_t>(value * bins_per_unit), kBins - 1);
    };
    for (const float value : squared) ++counts[bin_of(value)];
    std::size_t bin = 0, before = 0;
    while (before + counts[bin] < count_) before += counts[bin++];
    in_bin_.clear();
    for (const float value : squared) {
      if (bin_of(value) == bin) in_bin_.push_back(value);
    }
    const auto kth = in_bin_.begin() + static_cast<std::ptrdiff_t>(count_ - before - 1);
    std::ranges::nth_element(in_bin_, kth);
    return *kth;
  }

  [[nodiscard]] float reach_by_tree(const Eigen::Vector3f& point) {
    tree_.nearest(point, count_, found_);
    return std::max(std::sqrt(found_.back().squared_distance), std::numeric_limits<float>::min());
  }

  [[nodiscard]] Moments moments_by_tree(const Eigen::Vector3f& point) {
    reach_ = std::max(reach_, reach_by_tree(point));
    Moments moments;
    for (const KdTree::Neighbour& neighbour : found_) moments.add(points_[neighbour.index] - point);
    return moments;
  }

  std::span<const Eigen::Vector3f> points_;
  const Columns& columns_;
  const CubeRows& cubes_;
  float cube_mm_;
  const KdTree& tree_;
  std::size_t count_;
  float reach_ = 0.0F;           // of the farthest neighbour in the last run
  float gathered_reach_ = 0.0F;  // from any point of the run, all points so near are gathered
  Columns gathered_, near_;
  std::vector<float> in_bin_;
  std::vector<KdTree::Neighbour> found_;
};

}  // namespace

PlaneFit fit_plane(std::span<const Eigen::Vector3f> points, std::span<const KdTree::Neighbour> neighbours) {
  if (neighbours.size() < 3) return {};
  const Eigen::Vector3f origin = points[neighbours.front().index];  // keeps the sums small against the coordinates
  Moments moments;
  for (const KdTree::Neighbour& neighbour : neighbours) moments.add(points[neighbour.index] - origin);
  return plane_of(moments);
}

FittedNormals fitted_normals(std::span<const Eigen::Vector3f> points, const KdTree& tree, double spacing_mm,
                             std::size_t count, const Context& context) {
  constexpr std::size_t kGrain = 2048;
  constexpr double kSpacingsPerCube = 3.0;
  FittedNormals fitted;
  fitted.normals.resize(points.size());
  fitted.variation.resize(points.size());
  if (points.empty() || count == 0) return fitted;
  const double cube_mm = kSpacingsPerCube * std::max(spacing_mm, 1e-9);
  const CubeRows cubes(points, cube_mm);
  const auto order = cubes.order();
  ASBUILT_EXPECT(order.size() == points.size(), "finite points");
  Columns columns;
  columns.resize(order.size());
  parallel_for(context, order.size(), kGrain, [&](std::size_t k) {
    const Eigen::Vector3f& point = points[order[k]];
    columns.x[k] = point.x(), columns.y[k] = point.y(), columns.z[k] = point.z();
  });
  parallel_for_blocks(context, order.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    Neighbourhoods neighbourhoods(points, columns, cubes, static_cast<float>(cube_mm), tree,
                                  std::min(count, points.size()));
    for (std::size_t from = begin, to = begin; from < end; from = to) {
      to = neighbourhoods.gather_run(from, end);
      for (std::size_t k = from; k < to; ++k) {
        const PlaneFit plane = plane_of(neighbourhoods.moments_about(points[order[k]]));
        fitted.normals[order[k]] = plane.normal;
        fitted.variation[order[k]] = plane.variation;
      }
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
