// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::verify {

struct SegmentOptions {
  double band_mm = 1.0;           ///< certain: this close to the CAD with an agreeing normal
  double reach_mm = 10.0;         ///< deviations are followed this far (3 % of the diameter)
  double max_normal_angle = 0.8;  ///< radians
};

struct Segment {
  std::vector<std::uint32_t> part;    ///< indices into Scan::cloud, ascending
  std::vector<std::uint32_t> margin;  ///< the other points within reach, ascending
};

/// Cuts the part out of a scan at a pose. Certain points are those on the CAD; what departs from it is kept too, if its
/// connected surface ends within reach (a boss, a dent, a warp). A surface that goes on beyond is clutter. `background`
/// marks points that are never certain, one byte a point of the scan.
[[nodiscard]] Segment segment_part(const Pose& model_from_scan, const model::PreparedModel& model,
                                   const scan::Scan& scan, const std::vector<std::uint8_t>& background,
                                   const SegmentOptions& options, const Context& context);

}  // namespace asbuilt::verify
