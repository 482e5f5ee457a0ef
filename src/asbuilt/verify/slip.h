// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// The poses into which a part can slip: both ways along each loose direction of the surface that was found (the
/// eigenvectors of PoseEvidence::information with less than `min_held` per explained sample, at most three), each
/// moving the surface by `slip_mm` where it moves most. Turns that the part's symmetry allows are no slips.
[[nodiscard]] std::vector<Pose> slipped_poses(const Pose& model_from_scan, const PoseEvidence& evidence,
                                              const model::PreparedModel& model, double min_held, double slip_mm);

/// The pose moved along its loose directions (as above) for as long as the scan prefers the slipped pose, in steps of 3
/// % of the diameter and less. A surface without its edges leaves registration free to drift there; the edges are asked
/// here.
[[nodiscard]] Pose settled_between_edges(const Pose& model_from_scan, const PoseEvidence& evidence,
                                         const model::PreparedModel& model, double min_held, const ScanEvidence& scan,
                                         const EvidenceOptions& options);

/// By how many measurements a pose leads over the slipped pose that comes closest to it (see contrast()). Sees what
/// eigenvalues do not: that the sensor looked past the edge at which the part ends. Negative if a slip would be better.
[[nodiscard]] double least_lead_over_slips(const Pose& model_from_scan, const PoseEvidence& evidence,
                                           const model::PreparedModel& model, double min_held, double slip_mm,
                                           const ScanEvidence& scan, const EvidenceOptions& options);

}  // namespace asbuilt::verify
