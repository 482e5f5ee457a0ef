// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/detect/large_planes.h"
#include "asbuilt/detect/options.h"
#include "asbuilt/detect/pose_clusters.h"
#include "asbuilt/detect/voting.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::detect {

/// The samples of a scan that take part in detection: even at the model's sampling distance (Sec. 4: relative to the
/// model, never to the scene), without planes too large for the part (not in paper mode).
[[nodiscard]] Scene detection_scene(const scan::Scan& scan, const Codebook& codebook, const DetectOptions& options,
                                    const Context& context);
[[nodiscard]] Scene detection_scene(const scan::Scan& scan, const SampledScan& sampled, const DetectOptions& options);

/// Where the part may stand in a scan: local voting per scene reference point (Eq. 6-10), then pose clusters.
/// Sorted by decreasing votes; empty when nothing was voted for. Same bytes for any number of threads.
/// Errors: invalid_argument for options; cancelled.
[[nodiscard]] Result<std::vector<Hypothesis>> find_hypotheses(const scan::Scan& scan, const Codebook& codebook,
                                                              const DetectOptions& options, const Context& context);

/// The same with samples that are at hand, taken with the codebook's sampling distance and diameter.
[[nodiscard]] Result<std::vector<Hypothesis>> find_hypotheses(const scan::Scan& scan, const SampledScan& sampled,
                                                              const Codebook& codebook, const DetectOptions& options,
                                                              const Context& context);

}  // namespace asbuilt::detect
