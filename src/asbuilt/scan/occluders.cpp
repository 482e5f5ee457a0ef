// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/occluders.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"

namespace asbuilt::scan {
namespace {

constexpr int kSides = 12;
constexpr double kSteps[] = {1.5, 2.75, 4.0};  // spacings along the surface
constexpr double kNearerInSpacings = 3.0;      // what is nearer by less may be the surface itself, seen at a slant
constexpr double kNearerInSigmas = 6.0;

}  // namespace

Occluders::Occluders(const Scan& scan)
    : spacing_by_range_(scan.spacing_by_range), spacing_mm_(scan.spacing_mm), noise_sigma_mm_(scan.noise_sigma_mm) {
  if (scan.viewpoint.known()) image_.emplace(scan.cloud.positions, scan.spacing_mm, scan.viewpoint);
}

std::vector<std::uint8_t> Occluders::beside(const PointCloud& part, const Context& context) const {
  if (!image_) return {};
  ASBUILT_EXPECT(part.normals.size() == part.size(), "one normal a point");
  std::vector<std::uint8_t> marked(part.size(), 0);
  parallel_for(context, part.size(), 512, [&](std::size_t i) {
    const Eigen::Vector3d point = part.positions[i].cast<double>(), normal = part.normals[i].cast<double>();
    if (!(normal.norm() > 0.5)) return;
    const double spacing = spacing_by_range_.known() ? spacing_by_range_.at(point) : spacing_mm_;
    const double nearer = std::max(kNearerInSpacings * spacing, kNearerInSigmas * noise_sigma_mm_);
    const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    for (int side = 0; side < kSides && marked[i] == 0; ++side) {
      const double angle = 2.0 * std::numbers::pi * side / kSides;
      const Eigen::Vector3d along = std::cos(angle) * u + std::sin(angle) * v;
      marked[i] = std::ranges::any_of(
          kSteps, [&](double step) { return image_->hides(point + step * spacing * along, nearer); });
    }
  });
  return marked;
}

}  // namespace asbuilt::scan
