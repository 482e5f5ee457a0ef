// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::fuse {

/// What one refined scan saw of the part and around it.
struct SeenSegment {
  PointCloud cloud_in_scan;           ///< part and margin, with oriented normals
  std::vector<std::uint8_t> is_part;  ///< one a point, as cut out of this scan alone
  Pose model_from_scan = Pose::Identity();
  double noise_sigma_mm = 0.0;  ///< 0: unknown, a tenth of the spacing is assumed
  scan::Viewpoint viewpoint;    ///< in the frame of `cloud_in_scan`
};

/// Tells part from margin anew (one byte a point of each segment: 1 part) by what the other scans saw, under their
/// refined poses.
///
/// A point *agrees* with a part point of another scan that lies within two spacings, if it lies in that point's plane
/// within noise. Another scan *saw through* it if each of the three points that this scan measured next to the line of
/// sight lies behind it, so far that it stands clear of their planes. A point of the part leaves it if another scan saw
/// through it and it agrees with fewer than two points of others: flying points, clutter next to the part. A point of
/// the margin joins the part if it agrees with three that also face alike and nobody saw through it: walls of a boss
/// that were too narrow to be told from flying points within one scan. A place that only one scan saw stays as it is.
///
/// The same for any number of threads and any order of the segments. Cost: O(n) but for look-ups, and one look-up for
/// each scan at points that hardly agree. Errors: invalid_argument (flags or normals are not one a point), cancelled.
[[nodiscard]] Result<std::vector<std::vector<std::uint8_t>>> recut(std::span<const SeenSegment> segments,
                                                                   const Context& context);

}  // namespace asbuilt::fuse
