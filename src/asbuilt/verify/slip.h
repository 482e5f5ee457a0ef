// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// The poses into which a part can slip most easily: both ways along the loosest directions of the surface that was
/// found (the eigenvectors of PoseEvidence::information with the smallest eigenvalues), each moving the farthest corner
/// of the model's box by `slip_mm`.
[[nodiscard]] std::vector<Pose> slipped_poses(const Pose& model_from_scan, const PoseEvidence& evidence,
                                              const model::PreparedModel& model, double slip_mm);

/// The least share of its support that a pose loses by slipping: 0 if the part can slide or turn and be explained as
/// well. Sees what eigenvalues do not: that past an edge the surface ends.
[[nodiscard]] double slip_loss(const Pose& model_from_scan, const model::PreparedModel& model, double slip_mm,
                               const ScanEvidence& scan, double contradiction_weight, const EvidenceOptions& options);

}  // namespace asbuilt::verify
