// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/shadow_image.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace asbuilt::scan {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();

}  // namespace

Shadows ShadowImage::seen_from(const Eigen::Vector3d& position, double cell, const DepthJump& least_jump) {
  constexpr double kFewestAcross = 16.0, kMostAcross = 4096.0, kMostCellsPerPoint = 8.0;
  constexpr float kJumpInCells = 4.0F;
  double across = std::clamp(2.0 / std::max(cell, 1e-6), kFewestAcross, kMostAcross);
  project(position, static_cast<int>(across));
  const double most_cells = kMostCellsPerPoint * static_cast<double>(points_.size()) + kMostAcross;
  if (cells() > most_cells) {
    across = std::max(kFewestAcross, across * std::sqrt(most_cells / cells()));
    project(position, static_cast<int>(across));
  }
  DepthJump jump = least_jump;
  jump.share_of_depth = std::max(jump.share_of_depth, kJumpInCells * 2.0F / std::floor(static_cast<float>(across)));
  std::size_t hidden = 0, measured = 0;
  double gaps = 0.0;
  for (int side = 0; side < 6; ++side) {
    Side& image = sides_[static_cast<std::size_t>(side)];
    if (image.count == 0) continue;
    fill(image, side);
    for (const Place& place : place_) {
      if (place.side == side && jump.is_between(image.at(place.row, place.column), place.depth)) ++hidden;
    }
    measured += add_gaps(image, jump, gaps);
  }
  return {static_cast<double>(hidden) / static_cast<double>(std::max<std::size_t>(1, points_.size())),
          gaps / static_cast<double>(std::max<std::size_t>(1, measured))};
}

void ShadowImage::project(const Eigen::Vector3d& from, int across) {
  for (Side& side : sides_) side.count = 0;
  const Eigen::Vector3f origin = from.cast<float>();
  const float half = 0.5F * static_cast<float>(across);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3f ray = points_[i] - origin;
    Eigen::Index axis = 0;
    const float longest = std::max(ray.cwiseAbs().maxCoeff(&axis), 1e-12F);
    const auto cell = [&](Eigen::Index other) {
      return std::clamp(static_cast<int>((ray[other] / longest + 1.0F) * half), 0, across - 1);
    };
    const Place place{static_cast<int>(2 * axis) + (ray[axis] < 0.0F ? 1 : 0), cell((axis + 2) % 3),
                      cell((axis + 1) % 3), ray.norm()};
    place_[i] = place;
    Side& side = sides_[static_cast<std::size_t>(place.side)];
    if (side.count++ == 0) {
      side.first_row = side.last_row = place.row;
      side.first_column = side.last_column = place.column;
    }
    side.first_row = std::min(side.first_row, place.row);
    side.last_row = std::max(side.last_row, place.row);
    side.first_column = std::min(side.first_column, place.column);
    side.last_column = std::max(side.last_column, place.column);
  }
}

double ShadowImage::cells() const {
  double sum = 0.0;
  for (const Side& side : sides_) sum += side.count == 0 ? 0.0 : static_cast<double>(side.rows()) * side.columns();
  return sum;
}

void ShadowImage::fill(Side& image, int side) {
  image.depths.assign(static_cast<std::size_t>(image.rows()) * static_cast<std::size_t>(image.columns()), kNothing);
  for (const Place& place : place_) {
    if (place.side != side) continue;
    float& nearest = image.at(place.row, place.column);
    nearest = std::min(nearest, place.depth);
  }
}

// Adds the mean, over rows and over columns, of the empty cells between two measurements of different depth; returns
// the number of cells in which something was measured.
std::size_t ShadowImage::add_gaps(Side& image, const DepthJump& jump, double& gaps) {
  constexpr int kWidest = 30;  // a wider one counts as this: it may be a dark surface, or the end of the field of view
  std::size_t cells = 0;
  const auto pass = [&](int lines, int length, const auto& depth_at, bool count) {
    for (int line = 0; line < lines; ++line) {
      int last = -1;
      float last_depth = 0.0F;
      for (int i = 0; i < length; ++i) {
        const float depth = depth_at(line, i);
        if (depth == kNothing) continue;
        if (count) ++cells;
        const bool is_gap =
            last >= 0 && i - last > 1 && jump.is_between(std::min(depth, last_depth), std::max(depth, last_depth));
        if (is_gap) gaps += 0.5 * std::min(i - last - 1, kWidest);
        last = i;
        last_depth = depth;
      }
    }
  };
  const auto at = [&](int row, int column) { return image.at(image.first_row + row, image.first_column + column); };
  pass(image.rows(), image.columns(), at, true);
  pass(
      image.columns(), image.rows(), [&](int column, int row) { return at(row, column); }, false);
  return cells;
}

}  // namespace asbuilt::scan
