// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/detection.h"

namespace asbuilt::pipeline {

/// Whether any placement is accepted, but not beyond doubt, so that `reject_mirror_images` would look at it. Never in
/// paper mode.
[[nodiscard]] bool may_be_mirror_images(const std::vector<verify::Detection>& placements, const Options& options);

/// Rejects (`mirror_image`) the accepted placements in whose place the part's mirror image would explain the scan
/// better: parts come left and right, and of one that is nearly its own mirror image, a part of the other hand shows
/// hardly anything that the judge could hold against it on its own. The part is sought in the mirrored scan for that.
/// Placements beyond doubt are not asked. Errors: cancelled.
[[nodiscard]] Result<void> reject_mirror_images(std::vector<verify::Detection>& placements, const scan::Scan& scan,
                                                const model::PreparedModel& model, const detect::Codebook& codebook,
                                                const Options& options, const Context& context);

}  // namespace asbuilt::pipeline
