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

/// What a segment is when the others have had their say; one byte a point.
struct RecutSegment {
  std::vector<std::uint8_t> is_part;
  std::vector<std::uint8_t> in_doubt;  ///< part that is better left out of the merged cloud
};

/// Tells part from margin anew by what the other scans saw, under their refined poses.
///
/// A point *agrees* with a part point of another scan that lies within two spacings, if it lies in that point's plane
/// within noise; if it stands over that plane, this one speaks against it. Planes are those of single faces
/// (surface_normals.h), noise is what samples of the part differ by, at most what is stated. Another scan *saw through*
/// a point if each of the three points that it measured next to the line of sight lies behind it, so far that it stands
/// clear of their planes. A point of the part leaves it if another scan saw through it and it agrees with less than a
/// third of those that have a say: flying points, clutter next to the part. A point of the margin joins the part if it
/// agrees with three that also face alike and nobody saw through it: walls of a boss that were too narrow to be told
/// from flying points within one scan. A place that only one scan saw stays as it is.
///
/// Some doubt is left of a part point that agrees with at most half of those, if the nearest ray of more scans passed
/// it in that way than met the part within a spacing of it, or if it joined. It is *in doubt* if those scans are two
/// more, if it lies in the face of at most half of its neighbours in its own scan, or if a point of another scan, of
/// which there is no doubt, lies within 1.5 spacings: then the merged cloud covers its place without it.
///
/// The same for any number of threads and any order of the segments. Cost: O(n) but for look-ups, one fit of a face a
/// point, and one look-up for each scan at points that hardly agree. Errors: invalid_argument (flags or normals are not
/// one a point), cancelled.
[[nodiscard]] Result<std::vector<RecutSegment>> recut(std::span<const SeenSegment> segments, const Context& context);

}  // namespace asbuilt::fuse
