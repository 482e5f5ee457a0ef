// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/viewpoint.h"

#include <algorithm>
#include <cmath>

#include "asbuilt/scan/depth_image.h"

namespace asbuilt::scan {
namespace {

// Shares found on scans from known and from wrong viewpoints; see docs/scan.md.
constexpr double kMaxHiddenShare = 0.15;
constexpr double kMaxEdgeOnShare = 0.12;
constexpr double kMinFacingShare = 0.8;
constexpr double kEdgeOnCosine = 0.1;

template <class Count>
double share_of(std::size_t size, const Count& count) {
  const std::size_t step = std::max<std::size_t>(1, size / 20000);
  std::size_t hits = 0, total = 0;
  for (std::size_t i = 0; i < size; i += step, ++total) hits += count(i) ? 1 : 0;
  return total == 0 ? 0.0 : static_cast<double>(hits) / static_cast<double>(total);
}

}  // namespace

Eigen::Vector3d Viewpoint::towards_sensor(const Eigen::Vector3d& point_in_scan) const {
  if (kind == Kind::direction) return -value;
  if (kind == Kind::point) return (value - point_in_scan).normalized();
  return Eigen::Vector3d::Zero();
}

double hidden_share(std::span<const Eigen::Vector3f> points, double spacing_mm, const Viewpoint& viewpoint) {
  // Six spacings of depth are within reach of a slanted surface in neighbouring cells, not of a second layer.
  constexpr double kToleranceInSpacings = 6.0;
  const DepthImage image(points, spacing_mm, viewpoint);
  return share_of(points.size(), [&](std::size_t i) {
    const Eigen::Vector3d point = points[i].cast<double>();
    // A point slightly nearer than this one asks whether anything hides it.
    return image.hides(point, kToleranceInSpacings * spacing_mm);
  });
}

bool agrees_with_depth_order(std::span<const Eigen::Vector3f> points, std::span<const Eigen::Vector3f> normals,
                             std::span<const Eigen::Vector3f> file_normals, double spacing_mm,
                             const Viewpoint& viewpoint) {
  if (points.empty() || !viewpoint.known()) return false;
  const auto cosine = [&](std::size_t i, const Eigen::Vector3f& normal) {
    return viewpoint.towards_sensor(points[i].cast<double>()).dot(normal.cast<double>());
  };
  if (!file_normals.empty()) {
    const double facing = share_of(points.size(), [&](std::size_t i) { return cosine(i, file_normals[i]) > -0.2; });
    if (facing < kMinFacingShare) return false;
  }
  const double edge_on =
      share_of(points.size(), [&](std::size_t i) { return std::abs(cosine(i, normals[i])) < kEdgeOnCosine; });
  return edge_on <= kMaxEdgeOnShare && hidden_share(points, spacing_mm, viewpoint) <= kMaxHiddenShare;
}

}  // namespace asbuilt::scan
