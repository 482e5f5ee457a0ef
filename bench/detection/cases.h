// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/simulate/options.h"
#include "parts.h"

namespace asbuilt::bench {

/// What stands where the sensor aims: the part, nothing in particular, or something that looks like the part.
enum class Content { part, clutter, smaller, larger, mirrored, family };
[[nodiscard]] const char* name_of(Content content);

/// Bounds of the strata of the hidden share: [0, 0.3), [0.3, 0.6), [0.6, 0.8].
struct Stratum {
  const char* name;
  double low, high;
};
inline constexpr Stratum kStrata[] = {{"0-0.3", 0.0, 0.3}, {"0.3-0.6", 0.3, 0.6}, {"0.6-0.8", 0.6, 0.8}};
inline constexpr std::size_t kStrataCount = std::size(kStrata);
/// The stratum of a hidden share; kStrataCount where it lies in none.
[[nodiscard]] std::size_t stratum_of(double hidden);

/// One scan of the suite, before it is simulated. Everything follows from the seed and the list of parts.
struct Case {
  std::uint64_t seed = 0;
  std::size_t part = 0;  ///< index into the parts
  Content content = Content::part;
  std::size_t stratum = 0;  ///< that is asked for; only where the part is there
  simulate::SimulateOptions options;
};

/// Of six seeds in a row four show the part, two do not; part, stratum and kind of decoy go round independently.
/// `point_share` scales the number of points.
[[nodiscard]] Case case_of(std::uint64_t seed, std::span<const SuitePart> parts, double point_share);

/// The scan of a case with its truth.
struct CaseScan {
  PointCloud points_in_scan;
  std::optional<Pose> model_from_scan;
  double hidden = 1.0, occlusion = 1.0, clutter = 1.0;  ///< as the simulator measured them
  std::size_t part_points = 0;                          ///< of the points, those that lie on the part
  double deviation_ratio = 0.0;                         ///< largest as-built deviation / diameter
};

/// Simulates the case; where the hidden share misses its stratum, anew with other random numbers, at most five times.
[[nodiscard]] Result<CaseScan> scan_of(const Case& the_case, std::span<const SuitePart> parts, const Context& context);

/// The same scan in another frame, as exports often are: turned anyhow and shifted by up to five times the sensor's
/// distance, so that nothing tells where the sensor stood. Follows from the seed.
[[nodiscard]] CaseScan moved(const CaseScan& scan, std::uint64_t seed);

}  // namespace asbuilt::bench
