// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/inspect/spots.h"
#include "asbuilt/inspect/tolerance.h"

namespace asbuilt::inspect {

/// A connected piece of surface that deviates too far, all to one side.
struct Region {
  std::vector<std::uint32_t> spots;  ///< indices, ascending
  double area_mm2 = 0.0;
  Eigen::AlignedBox3d box;                           ///< of the spots
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< mean of the spots
  double mean_mm = 0.0;
  Peak peak;
  double limit_mm = 0.0;     ///< what the deviation exceeds at the peak
  std::uint32_t face = 0;    ///< index of the face that most of it lies on
  bool significant = false;  ///< the peak exceeds the limit by more than noise explains
};

struct RegionOptions {
  double spot_area_mm2 = 0.0, spacing_mm = 0.0;  ///< of the spots
  std::size_t most = 50;                         ///< regions that are given, largest first
  double significance = 3.0;                     ///< standard errors
};

struct FoundRegions {
  std::vector<Region> largest;  ///< at most RegionOptions::most
  std::size_t count = 0;        ///< all that there are
};

/// Connected spots out of tolerance: neighbours within 1.6 spacings whose normals differ by less than 60 degrees and
/// that deviate to the same side. Single and paired spots are left out. Largest area first, ties by the first spot.
/// `tolerance_of(spot)` is what holds there, or nothing; `face_of_spot` has an entry a spot.
[[nodiscard]] FoundRegions regions_out_of(const PointCloud& places, std::span<const Spot> spots,
                                                 std::span<const std::uint32_t> face_of_spot,
                                                 const std::function<const Tolerance*(std::uint32_t)>& tolerance_of,
                                                 const SpotFinder& finder, const RegionOptions& options);

}  // namespace asbuilt::inspect
