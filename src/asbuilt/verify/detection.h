// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"

namespace asbuilt::verify {

/// Why a scan has no accepted pose; the names in result.json are documented in docs/verify.md.
enum class Reason {
  none,
  no_hypothesis,        ///< detection proposed nothing
  low_score,            ///< too little of what should be visible was found
  poor_fit,             ///< points lie within the band, but strewn across it, not on the model
  normals_disagree,     ///< the surface is there, but not its normals
  free_space_violated,  ///< the sensor looked through the claimed material
  contradicted,         ///< the scan denies too much of the claimed surface
  weak_evidence,      ///< nothing speaks clearly against the pose, but score, fit and normals together prove too little
  under_constrained,  ///< what was found (a plane, say) would hold in other poses as well
  too_few_points,     ///< too little of the part in the scan to prove anything
  mirror_image,       ///< the part's mirror image would explain the scan better
  ambiguous_pose,     ///< a different pose explains the scan about as well
  second_instance,    ///< two placements of the part
  scan_too_small,     ///< size contradiction: probably a wrong unit
  wrong_unit,         ///< nothing found, but it would be with another unit
};
[[nodiscard]] const char* code_of(Reason reason);

/// A refined hypothesis with its evidence.
struct Candidate {
  Pose model_from_scan = Pose::Identity();
  double votes = 0.0;
  double score = 0.0;                  ///< Xi over what should be visible, in [0, 1]
  double visible_share = 0.0;          ///< Eq. 11 over all model samples, in [0, 1]
  double free_space_violations = 0.0;  ///< share of should-be-visible model samples that the sensor saw through
  double contradiction_share = 0.0;    ///< share of them that the scan denies: seen through, or a surface elsewhere
  double normal_agreement = 0.0;       ///< share of scan points on the model whose normals agree
  double rms_mm = 0.0;                 ///< of the inliers' distances to the model
  double residual_ratio = 0.0;         ///< rms_mm / score distance: 0.58 for points strewn evenly across the band
  double facing_share = 0.0;           ///< of all samples, those that ought to be visible: turned to the sensor, free
  double hidden_share = 0.0;           ///< share of the samples turned to the sensor that something stands in front of
  double found_share = 0.0;            ///< of the others, those that the scan confirms ...
  double missing_share = 0.0;          ///< ... and those where it has no return; the rest is contradiction_share
  double support = 0.0;  ///< (evidence for - weighted evidence against) / all samples: candidates compete by it
  double weakest_direction = 0.0;  ///< how well the confirmed surface holds the pose in its loosest direction; see docs
  double weakest_but_near = 0.0;   ///< the same without turns about axes of near-symmetry
  double slip_lead = 0.0;    ///< measurements by which it leads over any small slip; asked where the surface is loose
  int loose_directions = 0;  ///< in which the surface that was found does not hold it
  double size_hold = 0.0;    ///< how well the confirmed surface holds the part's size; see docs
  double size_lead = 0.0;    ///< measurements by which it leads over the part in another size; asked where it does not
  double lost_end_share =
      0.0;                     ///< of what was looked at, at an end of unknown place, where nothing came back; see docs
  double pierced_share = 0.0;  ///< of the part, what lies behind a flat surface that it would reach through
  double overrun_share = 0.0;  ///< share of the model's edges past which the scan's surface simply goes on
  int explained_samples = 0;   ///< model samples that the scan confirms
  double explained_measurements = 0.0;  ///< the same in measurements that count singly, as slip_lead does
  bool without_rays = false;            ///< the sensor's place is unknown: what it saw through cannot be asked
  Reason objection = Reason::none;      ///< what stands against it on its own, whatever its rivals
};

enum class Status { accepted, ambiguous, rejected };

/// What verification says of one scan.
struct Detection {
  Status status = Status::rejected;
  Reason reason = Reason::no_hypothesis;
  std::string explanation;            ///< one sentence with the numbers
  Candidate best;                     ///< meaningless when there was no hypothesis
  double margin = 0.0;                ///< best score minus that of the next different pose
  std::vector<Candidate> candidates;  ///< best first, at most 10, all different poses
  /// Points of Scan::cloud that belong to the part (ascending) - only for accepted and ambiguous scans.
  std::vector<std::uint32_t> segment;
  /// Points within 3 % of the diameter around the segment that do not belong to it (ascending).
  std::vector<std::uint32_t> margin_points;
};

}  // namespace asbuilt::verify
