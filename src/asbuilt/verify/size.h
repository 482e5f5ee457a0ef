// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// How firmly the surface that was found holds the part's size: the mean square by which the part, growing, would leave
/// that surface, in units of the growth of its half diameter, after it has moved so as to stay on it. 0 on three faces
/// that meet in a corner, which are those of a block of any size. The counterpart of PoseEvidence::weakest_direction.
[[nodiscard]] double size_hold(const PoseEvidence& evidence);

/// By how many measurements the pose leads over copies of the part, one to three tenths smaller and one to four tenths
/// larger, that lie on the same surface (see contrast()): whether its far edges were seen. Half of the lead over
/// copies 6 % smaller or larger that keep a corner of the part's box count likewise. The least of them; negative if
/// such a copy explains the scan better.
[[nodiscard]] double size_lead(const Pose& model_from_scan, const PoseEvidence& evidence,
                               const model::PreparedModel& model, const ScanEvidence& scan,
                               const EvidenceOptions& options);

}  // namespace asbuilt::verify
