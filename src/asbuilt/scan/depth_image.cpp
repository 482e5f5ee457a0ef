// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/depth_image.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/core/median.h"
#include "asbuilt/core/result.h"

namespace asbuilt::scan {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr int kMaxFaceCells = 2048;
// A cell a little wider than the spacing is seldom empty on a continuous surface.
constexpr double kCellPerSpacing = 1.5;

double median_range(std::span<const Eigen::Vector3f> points, const Eigen::Vector3d& from) {
  std::vector<double> ranges;
  const std::size_t step = std::max<std::size_t>(1, points.size() / 5000);
  for (std::size_t i = 0; i < points.size(); i += step) ranges.push_back((points[i].cast<double>() - from).norm());
  return median_of(std::move(ranges));
}

}  // namespace

DepthImage::DepthImage(std::span<const Eigen::Vector3f> points_in_scan, double spacing_mm, const Viewpoint& viewpoint)
    : viewpoint_(viewpoint) {
  ASBUILT_EXPECT(viewpoint.known(), "a known viewpoint");
  if (points_in_scan.empty()) return;
  const double cell_mm = kCellPerSpacing * std::max(spacing_mm, 1e-6);
  if (viewpoint.kind == Viewpoint::Kind::direction) {
    across_u_ = viewpoint.value.unitOrthogonal();
    across_v_ = viewpoint.value.cross(across_u_);
    Eigen::Vector2d high = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());
    low_ = -high;
    for (const Eigen::Vector3f& point : points_in_scan) {
      const Eigen::Vector2d place(point.cast<double>().dot(across_u_), point.cast<double>().dot(across_v_));
      low_ = low_.cwiseMin(place);
      high = high.cwiseMax(place);
    }
    const double widest = std::max((high - low_).maxCoeff(), cell_mm);
    cells_per_length_ = std::min(1.0 / cell_mm, 2.0 * kMaxFaceCells / widest);
    columns_[0] = static_cast<int>((high.x() - low_.x()) * cells_per_length_) + 1;
    rows_[0] = static_cast<int>((high.y() - low_.y()) * cells_per_length_) + 1;
  } else {
    const double range = std::max(median_range(points_in_scan, viewpoint.value), cell_mm);
    const int cells = std::clamp(static_cast<int>(2.0 * range / cell_mm), 16, kMaxFaceCells);
    cells_per_length_ = 0.5 * cells;
    rows_.fill(cells);
    columns_.fill(cells);
  }
  for (const Eigen::Vector3f& point : points_in_scan) {
    const Cell c = cell(point.cast<double>());
    if (c.face < 0) continue;
    const auto face = static_cast<std::size_t>(c.face);
    std::vector<float>& depths = depths_[face];
    if (depths.empty()) {
      depths.assign(static_cast<std::size_t>(rows_[face]) * static_cast<std::size_t>(columns_[face]), kNothing);
    }
    float& nearest = depths[static_cast<std::size_t>(c.row) * static_cast<std::size_t>(columns_[face]) +
                            static_cast<std::size_t>(c.column)];
    nearest = std::min(nearest, c.depth);
  }
}

DepthImage::Cell DepthImage::cell(const Eigen::Vector3d& point_in_scan) const {
  Cell result;
  if (viewpoint_.kind == Viewpoint::Kind::direction) {
    const double x = (point_in_scan.dot(across_u_) - low_.x()) * cells_per_length_;
    const double y = (point_in_scan.dot(across_v_) - low_.y()) * cells_per_length_;
    if (!(x >= 0.0 && y >= 0.0 && x < columns_[0] && y < rows_[0])) return result;
    return {0, static_cast<int>(y), static_cast<int>(x), static_cast<float>(point_in_scan.dot(viewpoint_.value))};
  }
  const Eigen::Vector3d ray = point_in_scan - viewpoint_.value;
  Eigen::Index axis = 0;
  const double longest = ray.cwiseAbs().maxCoeff(&axis);
  if (!(longest > 0.0)) return result;
  const auto face = static_cast<int>(2 * axis) + (ray[axis] < 0.0 ? 1 : 0);
  const int cells = rows_[static_cast<std::size_t>(face)];
  const auto index = [&](Eigen::Index other) {
    return std::clamp(static_cast<int>((ray[other] / longest + 1.0) * cells_per_length_), 0, cells - 1);
  };
  return {face, index((axis + 2) % 3), index((axis + 1) % 3), static_cast<float>(ray.norm())};
}

float DepthImage::depth_at(int face, int row, int column) const {
  const auto f = static_cast<std::size_t>(face);
  if (depths_[f].empty() || row < 0 || column < 0 || row >= rows_[f] || column >= columns_[f]) return kNothing;
  return depths_[f][static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_[f]) +
                    static_cast<std::size_t>(column)];
}

DepthImage::Evidence DepthImage::evidence(const Eigen::Vector3d& point_in_scan, double tolerance_mm) const {
  const Cell c = cell(point_in_scan);
  if (c.face < 0) return Evidence::unknown;
  const auto tolerance = static_cast<float>(tolerance_mm);
  int nearer = 0, alike = 0, farther = 0;
  for (int row = c.row - 1; row <= c.row + 1; ++row) {
    for (int column = c.column - 1; column <= c.column + 1; ++column) {
      const float depth = depth_at(c.face, row, column);
      if (depth == kNothing) continue;
      ++(std::abs(depth - c.depth) <= tolerance ? alike : depth < c.depth ? nearer : farther);
    }
  }
  // What is measured beside the edge of something in front says nothing about what lies behind that.
  const float straight = depth_at(c.face, c.row, c.column);
  const bool is_covered = straight < c.depth - tolerance;
  if (alike > 0) return is_covered ? Evidence::hidden : Evidence::near;
  // One stray return proves nothing, and where both sides are seen an edge passes.
  constexpr int kEnough = 2;
  if (nearer >= kEnough && farther == 0) return Evidence::hidden;
  if (farther >= kEnough && nearer == 0) return Evidence::free;
  return Evidence::unknown;
}

bool DepthImage::hides(const Eigen::Vector3d& point_in_scan, double tolerance_mm) const {
  const Cell c = cell(point_in_scan);
  return c.face >= 0 && depth_at(c.face, c.row, c.column) < c.depth - static_cast<float>(tolerance_mm);
}

}  // namespace asbuilt::scan
