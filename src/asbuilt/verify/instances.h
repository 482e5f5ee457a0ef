// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/detect.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/detection.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::verify {

/// All placements of the part in a scan, best first; where there is none, the one detection that says why.
///
/// Placements are found one after another. What an accepted one explains may hide and reveal after it, but confirms
/// nothing more: every placement must be proved by points of its own, with the same thresholds, and be comparable to
/// the best. A rival elsewhere that finds no points of its own explains those of another placement, which is then
/// ambiguous, as it is among poses in one place.
///
/// `sampled`, if it is at hand, is the scan as detection looked at it. A point of the scan belongs to at most one
/// segment: that of the placement whose surface it lies nearest to.
[[nodiscard]] Result<std::vector<Detection>> verify_instances(const scan::Scan& scan, const model::PreparedModel& model,
                                                              std::span<const detect::Hypothesis> hypotheses,
                                                              const VerifyOptions& options, const Context& context,
                                                              const detect::SampledScan* sampled = nullptr);

/// Takes from each segment the points that lie nearer to the surface of another placement; equal distances go to the
/// better one. What a segment loses becomes its margin.
void separate_segments(std::span<Detection> placements, const scan::Scan& scan, const model::PreparedModel& model,
                       const Context& context);

}  // namespace asbuilt::verify
