// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/contrast.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// How many loose directions the surface that was found has: eigenvectors of PoseEvidence::information with less than
/// `min_held` per explained sample, at most three (a plane's). Turns that the part's symmetry allows do not count.
[[nodiscard]] int loose_directions(const PoseEvidence& evidence, const model::PreparedModel& model, double min_held);

/// Both ways along each loose direction alone (2, 4 or 6 slips), or along all their sums and differences too (2, 8 or
/// 26): an edge may be followed by a shift and a turn at once.
enum class Slips { single, combined };

/// The poses into which a part can slip, each moving the surface by `slip_mm` where it moves most. The
/// i-th and the i-th last are opposite.
[[nodiscard]] std::vector<Pose> slipped_poses(const Pose& model_from_scan, const PoseEvidence& evidence,
                                              const model::PreparedModel& model, double min_held, double slip_mm,
                                              Slips kinds);

/// The pose moved along its loose directions (as above) for as long as the scan prefers the slipped pose, in steps of 3
/// % of the diameter and less. A surface without its edges leaves registration free to drift there; the edges are asked
/// here.
[[nodiscard]] Pose settled_between_edges(const Pose& model_from_scan, const PoseEvidence& evidence,
                                         const model::PreparedModel& model, double min_held, const ScanEvidence& scan,
                                         const EvidenceOptions& options);

/// A pose into which the part may have slipped, and by how many measurements another leads over it (see contrast());
/// negative if this one explains the scan better, infinite if there is none.
struct Slip {
  Pose model_from_scan = Pose::Identity();
  double lead_over_it = std::numeric_limits<double>::infinity();
};

/// The slipped pose that comes closest to a pose, of which `contrast` is. Sees what eigenvalues do not: that the sensor looked past the edge at
/// which the part ends.
[[nodiscard]] Slip strongest_slip(const Pose& model_from_scan, const PoseEvidence& evidence,
                                  const model::PreparedModel& model, double min_held, double slip_mm,
                                  ContrastOf& contrast);

}  // namespace asbuilt::verify
