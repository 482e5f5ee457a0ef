// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// A place just past an edge of the model, sharp or rounded, in the plane of the face that ends there. All in the model
/// frame.
struct RimProbe {
  Eigen::Vector3f on_face;  ///< a sample of the face, near its edge
  Eigen::Vector3f normal;   ///< of the face
  Eigen::Vector3f beyond;   ///< `reach_mm` away along the face, or two or three times that far, where the model has no
                            ///< surface any more
  bool two_sided = false;   ///< the face belongs to an open skin and may be seen from behind
};

/// Probes around the first `most_samples` of the model's dense samples.
[[nodiscard]] std::vector<RimProbe> rim_probes(const model::PreparedModel& model, double reach_mm,
                                               std::size_t most_samples);

/// What the scan shows past the edges. A part ends at its edges, so there the scan should show nothing, or something
/// of another direction; where its surface simply goes on, the part was laid onto something larger.
struct RimEvidence {
  std::size_t asked = 0;    ///< probes whose face was found and past whose edge nothing blocks the view
  std::size_t overrun = 0;  ///< of those, where the surface goes on

  [[nodiscard]] double overrun_share() const {
    return asked == 0 ? 0.0 : static_cast<double>(overrun) / static_cast<double>(asked);
  }
};

[[nodiscard]] RimEvidence rim_evidence(const Pose& model_from_scan, std::span<const RimProbe> probes, double reach_mm,
                                       const ScanEvidence& scan, const EvidenceOptions& options);

}  // namespace asbuilt::verify
