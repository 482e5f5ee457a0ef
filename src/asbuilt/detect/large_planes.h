// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::detect {

/// A flat piece this much longer than the part's diameter cannot be its.
inline constexpr double kLargestExtentRatio = 1.1;

/// Marks samples on connected flat pieces that extend further than `largest_extent_mm`: floors, walls and tables that
/// cannot belong to the part, and would drown it. `spacings_mm` are the distances between neighbouring samples, one a
/// sample: far from the sensor they may be wider than elsewhere.
[[nodiscard]] std::vector<std::uint8_t> on_large_planes(const PointCloud& samples, std::span<const float> spacings_mm,
                                                        double largest_extent_mm, const Context& context);

/// A scan as detection and verification both look at it.
struct SampledScan {
  PointCloud samples;                        ///< even, at the model's sampling distance
  std::vector<float> spacings_mm;            ///< one a sample: that distance, or that of the scan there if it is wider
  std::vector<std::uint8_t> on_large_plane;  ///< one a sample: 1 where it lies on a plane too large for the part
};

[[nodiscard]] SampledScan sampled_scan(const scan::Scan& scan, double spacing_mm, double diameter_mm,
                                       const Context& context);

/// The marks of the samples carried over to every point of the scan.
[[nodiscard]] std::vector<std::uint8_t> points_on_large_planes(const scan::Scan& scan, const SampledScan& sampled,
                                                               const Context& context);

}  // namespace asbuilt::detect
