// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/detect.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::pipeline {

/// What detection and verification make of one scan.
struct FoundPart {
  std::vector<verify::Detection> placements;   ///< one, or with `Instances::all` all of them; one that says why if none
  std::vector<detect::Hypothesis> hypotheses;  ///< that the last look verified, starts of the user among them
  detect::SampledScan sampled;                 ///< the scan as detection looked at it
  std::uint64_t votes_cast = 0;                ///< over all looks
  int looks = 0;                               ///< 1: the first one was enough
};

/// Runs `work` and takes its time for a stage ("detect" or "verify"); a stage may come more than once.
using TimedStage = std::function<void(std::string_view stage, const std::function<void()>& work)>;

/// Finds the part in a scan. A first look with few reference points (Sec. 3.1) is enough where the judge has no doubt
/// about what it proposes; else more of them vote, and everything is judged again, what the first look left among it.
/// If that is rejected, a last look takes many more, since in a hall hardly any of them lie on the part. Paper mode, and
/// the search for all placements, look once and thoroughly. What is found but not beyond doubt is held against its mirror
/// image last.
///
/// `starts` are poses of the user; they come first, with the votes of the best hypothesis.
/// Errors: invalid_argument for options; cancelled.
[[nodiscard]] Result<FoundPart> find_part(const scan::Scan& scan, const model::PreparedModel& model,
                                          const detect::Codebook& codebook, const std::vector<Pose>& starts,
                                          const Options& options, const TimedStage& timed, const Context& context);

}  // namespace asbuilt::pipeline
