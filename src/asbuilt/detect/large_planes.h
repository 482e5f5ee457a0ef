// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::detect {

/// A flat piece this much longer than the part's diameter cannot be its.
inline constexpr double kLargestExtentRatio = 1.1;

/// Marks samples on connected flat pieces that extend further than `largest_extent_mm`: floors, walls and tables that
/// cannot belong to the part, and would drown it. `spacing_mm` is the distance between neighbouring samples.
[[nodiscard]] std::vector<std::uint8_t> on_large_planes(const PointCloud& samples, double spacing_mm,
                                                        double largest_extent_mm, const Context& context);

/// The same for every point of a scan: 1 where it lies on such a plane.
[[nodiscard]] std::vector<std::uint8_t> points_on_large_planes(const scan::Scan& scan, double spacing_mm,
                                                               double largest_extent_mm, const Context& context);

}  // namespace asbuilt::detect
