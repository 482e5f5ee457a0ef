// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// Of what a pose claims and the sensor looked at, the share that lies at one end of the part, along an axis of its box
/// (in CAD coordinates), and from which nothing came back; the largest over the ends of those axes along which nothing
/// of the surface that was found tells how long the part is, as of a block of which one corner is in sight. A block
/// that ends where the part goes on looks just like that, and so does the part behind something too near to be
/// measured. Between 0 and 1. Needs a viewpoint.
[[nodiscard]] double lost_end_share(const Pose& model_from_scan, const model::PreparedModel& model,
                                    const ScanEvidence& scan, const EvidenceOptions& options);

}  // namespace asbuilt::verify
