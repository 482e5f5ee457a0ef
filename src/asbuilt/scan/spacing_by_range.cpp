// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/spacing_by_range.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "asbuilt/core/median.h"
#include "asbuilt/core/result.h"

namespace asbuilt::scan {
namespace {

constexpr std::size_t kMostAsked = 8000, kMostBands = 16, kFewestInBand = 50;

struct Asked {
  double range_mm, spacing_mm;
};

// Of points spread over the scan, in the order of their ranges.
std::vector<Asked> asked_points(std::span<const Eigen::Vector3f> points, const KdTree& tree,
                                const Eigen::Vector3d& viewpoint) {
  std::vector<Asked> asked;
  std::vector<KdTree::Neighbour> neighbours;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kMostAsked);
  for (std::size_t i = 0; i < points.size(); i += step) {
    tree.nearest(points[i], 2, neighbours);  // itself, and the next
    const double next = neighbours.back().squared_distance;
    if (next > 0.0) asked.push_back({(points[i].cast<double>() - viewpoint).norm(), std::sqrt(next)});
  }
  std::ranges::sort(asked, {}, [](const Asked& a) { return std::pair(a.range_mm, a.spacing_mm); });
  return asked;
}

}  // namespace

SpacingByRange::SpacingByRange(std::span<const Eigen::Vector3f> points_in_scan, const KdTree& tree,
                               const Viewpoint& viewpoint) {
  if (viewpoint.kind != Viewpoint::Kind::point) return;
  viewpoint_ = viewpoint.value;
  const std::vector<Asked> asked = asked_points(points_in_scan, tree, viewpoint_);
  const std::size_t bands = std::min(kMostBands, asked.size() / kFewestInBand);
  if (bands < 2) return;
  for (std::size_t band = 0; band < bands; ++band) {
    std::vector<double> ranges, spacings;
    for (std::size_t i = band * asked.size() / bands; i < (band + 1) * asked.size() / bands; ++i) {
      ranges.push_back(asked[i].range_mm);
      spacings.push_back(asked[i].spacing_mm);
    }
    ranges_mm_.push_back(median_of(std::move(ranges)));
    spacings_mm_.push_back(median_of(std::move(spacings)));
  }
}

double SpacingByRange::at(const Eigen::Vector3d& point_in_scan) const {
  ASBUILT_EXPECT(known(), "a spacing that was measured");
  const double range = (point_in_scan - viewpoint_).norm();
  const auto next = std::ranges::upper_bound(ranges_mm_, range);
  if (next == ranges_mm_.begin()) return spacings_mm_.front();
  if (next == ranges_mm_.end()) return spacings_mm_.back();
  const auto i = static_cast<std::size_t>(next - ranges_mm_.begin());
  const double width = ranges_mm_[i] - ranges_mm_[i - 1];
  const double share = width > 0.0 ? (range - ranges_mm_[i - 1]) / width : 0.0;
  return spacings_mm_[i - 1] + share * (spacings_mm_[i] - spacings_mm_[i - 1]);
}

}  // namespace asbuilt::scan
