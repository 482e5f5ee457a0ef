// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::verify {

/// Whether a part at a pose would reach through a flat surface that is not its own, as a box does that was laid onto
/// something smaller that stands on a table: what is below the table nobody saw, and so no ray denies it. The share of
/// the part on the lesser side of that surface, the largest over those near it; 0 where the part does not touch the
/// surface along where the two would meet (it may reach past its rim). Between 0 and 0.5.
/// `distance_mm` is what counts as on the model.
[[nodiscard]] double pierced_share(const Pose& model_from_scan, const model::PreparedModel& model,
                                   const scan::Scan& scan, double distance_mm);

}  // namespace asbuilt::verify
