// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/regions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/kd_tree.h"

namespace asbuilt::inspect {
namespace {

constexpr double kNeighbourSpacings = 1.6;
constexpr float kSameSideCosine = 0.5F;
constexpr std::size_t kLeastSpots = 3;
constexpr double kLeastPeakReachSpacings = 1.5, kMostPeakReachSpacings = 3.0;
constexpr double kLeastPeakReachPointSpacings = 5.0;  // some 80 points tell how rough a surface is

/// A spot that deviates too far, and to which side.
struct Outlier {
  std::uint32_t spot = 0;
  int side = 0;
  double limit = 0.0;
};

std::vector<std::vector<int>> connected(const std::vector<Outlier>& outliers, const PointCloud& places,
                                        double reach_mm) {
  std::vector<Eigen::Vector3f> positions;
  for (const Outlier& outlier : outliers) positions.push_back(places.positions[outlier.spot]);
  const KdTree tree(positions);
  DisjointSets sets(static_cast<int>(outliers.size()));
  std::vector<KdTree::Neighbour> near;
  for (std::size_t i = 0; i < outliers.size(); ++i) {
    tree.within(positions[i], static_cast<float>(reach_mm), near);
    for (const KdTree::Neighbour& neighbour : near) {
      const Outlier& other = outliers[neighbour.index];
      if (other.side != outliers[i].side) continue;
      const float cosine = places.normals[outliers[i].spot].dot(places.normals[other.spot]);
      if (cosine > kSameSideCosine) sets.unite(static_cast<int>(i), static_cast<int>(neighbour.index));
    }
  }
  return sets.by_decreasing_size();
}

std::uint32_t most_frequent(const std::vector<std::uint32_t>& spots, std::span<const std::uint32_t> face_of_spot) {
  std::map<std::uint32_t, std::size_t> counts;
  for (const std::uint32_t spot : spots) ++counts[face_of_spot[spot]];
  return std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; })->first;
}

}  // namespace

FoundRegions regions_out_of(const PointCloud& places, std::span<const Spot> spots,
                            std::span<const std::uint32_t> face_of_spot,
                            const std::function<const Tolerance*(std::uint32_t)>& tolerance_of,
                            const SpotFinder& finder, const RegionOptions& options) {
  std::vector<Outlier> outliers;
  for (std::uint32_t i = 0; i < spots.size(); ++i) {
    const Tolerance* tolerance = tolerance_of(i);
    if (!spots[i].is_scanned() || tolerance == nullptr) continue;
    const auto deviation = static_cast<double>(spots[i].deviation_mm);
    if (deviation > tolerance->high_mm) outliers.push_back({i, 1, tolerance->high_mm});
    if (deviation < tolerance->low_mm) outliers.push_back({i, -1, tolerance->low_mm});
  }
  FoundRegions found;
  if (outliers.empty()) return found;
  for (const std::vector<int>& members : connected(outliers, places, kNeighbourSpacings * options.spacing_mm)) {
    if (members.size() < kLeastSpots) break;  // by decreasing size
    if (++found.count > options.most) continue;
    Region region;
    const Outlier* peak = nullptr;
    double beyond = -1.0;
    for (const int member : members) {
      const Outlier& outlier = outliers[static_cast<std::size_t>(member)];
      const auto deviation = static_cast<double>(spots[outlier.spot].deviation_mm);
      const Eigen::Vector3d position = places.positions[outlier.spot].cast<double>();
      region.spots.push_back(outlier.spot);
      region.box.extend(position);
      region.centre += position / static_cast<double>(members.size());
      region.mean_mm += deviation / static_cast<double>(members.size());
      if (std::abs(deviation - outlier.limit) <= beyond) continue;
      beyond = std::abs(deviation - outlier.limit);
      peak = &outlier;
    }
    region.area_mm2 = static_cast<double>(members.size()) * options.spot_area_mm2;
    region.limit_mm = peak->limit;
    region.face = most_frequent(region.spots, face_of_spot);
    // The dent and its flanks, which tell how rough the surface is there.
    const double extent = std::sqrt(region.area_mm2 / std::numbers::pi);
    const double wanted = std::clamp(2.0 * extent, kLeastPeakReachSpacings * options.spacing_mm,
                                     kMostPeakReachSpacings * options.spacing_mm);
    const double reach = std::max(wanted, kLeastPeakReachPointSpacings * finder.spacing_mm());
    region.peak = finder.peak_near(places.positions[peak->spot], places.normals[peak->spot], peak->side, reach,
                                   spots[peak->spot]);
    const double excess = peak->side * (region.peak.deviation_mm - region.limit_mm);
    const double error = region.peak.standard_error_mm;
    region.significant = std::isfinite(error) && excess > options.significance * error;
    found.largest.push_back(std::move(region));
  }
  return found;
}

}  // namespace asbuilt::inspect
