// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/field_of_view.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "asbuilt/core/median.h"
#include "asbuilt/core/result.h"

namespace asbuilt::scan {
namespace {

using Eigen::Vector2d;

constexpr double kWidest = 0.342;            // cosine of the angle to the mean ray: 70 degrees
constexpr int kMostCells = 1024;             // along the image
constexpr double kCellPerSpacing = 1.5;      // a cell is then seldom empty on a continuous surface
constexpr double kNearSide = 1.0;            // cells from a side up to which a measurement touches it ...
constexpr double kBentSide = 0.003;          // ... and of the image's width, since lenses bend lines
constexpr double kBin = 3.0;                 // cells: the pieces of a side that are touched or not
constexpr std::size_t kMostDirections = 32;  // of the outline's edges, the longest first

struct Image {
  std::vector<Vector2d> places;
  double cell = 0.0;
};

// In the row or column of cells of each, the first and the last: all that can lie on the outline of a convex field.
std::vector<Vector2d> outline(const Image& image) {
  Vector2d low = image.places.front(), high = low;
  for (const Vector2d& place : image.places) {
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  std::vector<Vector2d> extremes;
  for (const int along : {0, 1}) {
    const int across = 1 - along;
    const auto rows = static_cast<std::size_t>((high[across] - low[across]) / image.cell) + 1;
    std::vector<const Vector2d*> first(rows, nullptr), last(rows, nullptr);
    for (const Vector2d& place : image.places) {
      const auto row = std::min(rows - 1, static_cast<std::size_t>((place[across] - low[across]) / image.cell));
      if (first[row] == nullptr || place[along] < (*first[row])[along]) first[row] = &place;
      if (last[row] == nullptr || place[along] > (*last[row])[along]) last[row] = &place;
    }
    for (std::size_t row = 0; row < rows; ++row) {
      if (first[row] == nullptr) continue;
      extremes.push_back(*first[row]);
      extremes.push_back(*last[row]);
    }
  }
  return extremes;
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// Andrew's monotone chain, counter-clockwise.
std::vector<Vector2d> convex_hull(std::vector<Vector2d> points) {
  std::ranges::sort(
      points, [](const Vector2d& a, const Vector2d& b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
  std::vector<Vector2d> hull;
  const auto add = [&](const Vector2d& point, std::size_t fewest) {
    while (hull.size() > fewest && cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0.0) {
      hull.pop_back();
    }
    hull.push_back(point);
  };
  for (const Vector2d& point : points) add(point, 1);
  const std::size_t lower = hull.size();
  for (auto point = points.rbegin() + 1; point != points.rend(); ++point) add(*point, lower);
  hull.pop_back();
  return hull;
}

// Directions of the hull's edges, the longest first.
std::vector<Vector2d> edge_directions(const std::vector<Vector2d>& hull) {
  std::vector<Vector2d> edges;
  for (std::size_t i = 0; i < hull.size(); ++i) edges.emplace_back(hull[(i + 1) % hull.size()] - hull[i]);
  std::ranges::stable_sort(edges, [](const Vector2d& a, const Vector2d& b) { return a.norm() > b.norm(); });
  edges.resize(std::min(edges.size(), kMostDirections));
  for (Vector2d& edge : edges) edge.normalize();
  return edges;
}

// A line of the image: `outwards` . place = offset.
struct Line {
  Vector2d outwards;
  double offset;
};

struct Rectangle {
  std::vector<Line> shown;  // the sides that are touched along enough of their length
  double touched = 0.0;     // length of these
};

Rectangle rectangle_along(const Vector2d& direction, const std::vector<Vector2d>& extremes, double cell) {
  const std::array<Vector2d, 2> axes{direction, Vector2d(-direction.y(), direction.x())};
  std::array<double, 2> low, high;
  for (const std::size_t k : {0, 1}) {
    low[k] = std::numeric_limits<double>::infinity();
    high[k] = -low[k];
    for (const Vector2d& place : extremes) {
      low[k] = std::min(low[k], axes[k].dot(place));
      high[k] = std::max(high[k], axes[k].dot(place));
    }
  }
  Rectangle rectangle;
  std::vector<std::uint8_t> is_touched;
  for (const std::size_t k : {0, 1}) {
    const Vector2d &outwards = axes[k], &along = axes[1 - k];
    const double length = high[1 - k] - low[1 - k];
    const double reach = kNearSide * cell + kBentSide * (high[k] - low[k]);
    for (const double sign : {-1.0, 1.0}) {
      const double offset = sign > 0.0 ? high[k] : -low[k];
      is_touched.assign(static_cast<std::size_t>(length / (kBin * cell)) + 1, 0);
      for (const Vector2d& place : extremes) {
        if (sign * outwards.dot(place) < offset - reach) continue;
        const auto bin = static_cast<std::size_t>((along.dot(place) - low[1 - k]) / (kBin * cell));
        is_touched[std::min(bin, is_touched.size() - 1)] = 1;
      }
      const double share =
          static_cast<double>(std::ranges::count(is_touched, 1)) / static_cast<double>(is_touched.size());
      if (share < FieldOfView::kTouched) continue;
      rectangle.shown.push_back({sign * outwards, offset});
      rectangle.touched += share * length;
    }
  }
  return rectangle;
}

// The sides that the measurements in an image show.
std::vector<Line> shown_sides(const Image& image) {
  constexpr std::size_t kFewest = 100;  // below, every outline is a polygon
  if (image.places.size() < kFewest) return {};
  const std::vector<Vector2d> extremes = outline(image);
  Rectangle best;
  for (const Vector2d& direction : edge_directions(convex_hull(extremes))) {
    Rectangle rectangle = rectangle_along(direction, extremes, image.cell);
    if (rectangle.touched > best.touched) best = std::move(rectangle);
  }
  return best.shown;
}

// No finer than the image is wide in cells at most.
double cell_of(const std::vector<Vector2d>& places, double spacing) {
  Vector2d low = places.front(), high = low;
  for (const Vector2d& place : places) {
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  return std::max({kCellPerSpacing * spacing, (high - low).maxCoeff() / kMostCells, 1e-9});
}

}  // namespace

FieldOfView::FieldOfView(std::span<const Eigen::Vector3f> points_in_scan, double spacing_mm,
                         const Viewpoint& viewpoint) {
  ASBUILT_EXPECT(viewpoint.known(), "a known viewpoint");
  if (points_in_scan.empty()) return;
  const bool is_parallel = viewpoint.kind == Viewpoint::Kind::direction;
  if (!is_parallel) origin_ = viewpoint.value;

  Eigen::Vector3d middle = viewpoint.value;
  std::vector<Eigen::Vector3d> rays;
  if (!is_parallel) {
    middle.setZero();
    for (const Eigen::Vector3f& point : points_in_scan) {
      rays.emplace_back(point.cast<double>() - origin_);
      middle += rays.back().normalized();
    }
    if (!(middle.norm() > 0.0)) return;
    middle.normalize();
  }
  const Eigen::Vector3d u = middle.unitOrthogonal(), v = middle.cross(u);
  Image image;
  if (is_parallel) {
    for (const Eigen::Vector3f& point : points_in_scan) {
      image.places.emplace_back(point.cast<double>().dot(u), point.cast<double>().dot(v));
    }
    image.cell = cell_of(image.places, spacing_mm);
  } else {
    std::vector<double> ranges;
    for (const Eigen::Vector3d& ray : rays) {
      const double depth = ray.dot(middle);
      ranges.push_back(ray.norm());
      if (!(depth > kWidest * ranges.back())) return;
      image.places.emplace_back(ray.dot(u) / depth, ray.dot(v) / depth);
    }
    image.cell = cell_of(image.places, spacing_mm / std::max(median_of(std::move(ranges)), 1e-9));
  }
  for (const Line& side : shown_sides(image)) {
    const Eigen::Vector3d across = side.outwards.x() * u + side.outwards.y() * v;
    const double offset = side.offset + image.cell;
    if (is_parallel) {
      sides_.push_back({across, offset});
    } else {
      sides_.push_back({(across - offset * middle).normalized(), 0.0});
    }
  }
}

bool FieldOfView::is_outside(const Eigen::Vector3d& point_in_scan) const {
  const Eigen::Vector3d from_origin = point_in_scan - origin_;
  return std::ranges::any_of(sides_, [&](const Side& side) { return side.outwards.dot(from_origin) > side.offset_mm; });
}

}  // namespace asbuilt::scan
