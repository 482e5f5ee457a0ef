// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/posed_scans.h"

namespace asbuilt::pipeline {

/// For a part that any turn about an axis leaves within `near_equal_ratio` of the diameter of itself (a rotor with low
/// ribs), so that verification accepts a scan without its turn (verify::turns_are_nearly_equal): gives each scan the
/// turn at which it meets the CAD (refine::turn_on_model), before scans that stand between draw others off theirs.
/// Detected poses change with it. If at least two scans show theirs, those that do not are taken out of `scans` and
/// become ambiguous (`symmetry`) in the record; else none is taken out, and the record says so. Errors: cancelled.
[[nodiscard]] Result<void> choose_turns(std::vector<PosedScan>& scans, const LoadedModel& model,
                                        double near_equal_ratio, io::RunRecord& record, const Context& context);

/// For a part with a finite symmetry group: gives each scan of a refined component the placement that what was built
/// tells (refine::choose_elements); detected and starting poses change with it. Scans for which nothing tells are taken
/// out of `scans` and become ambiguous (`symmetry`) in the record. If nothing tells for any scan, all placements show
/// one surface to within the noise: the scans stay as they are and the record says so (`symmetry`, accepted); likewise
/// if they may slide along one another by more than 0.3 % of the diameter. Gives whether poses or scans have changed,
/// so that all must be linked and refined anew. Errors: cancelled.
[[nodiscard]] Result<bool> choose_placements(const RefinedComponent& component, std::vector<PosedScan>& scans,
                                             const LoadedModel& model, io::RunRecord& record, const Context& context);

/// Looks for two individuals among the scans of a refined component (refine::two_individuals). The scans of the smaller
/// one get another PosedScan::individual, so that nothing links them to the others any more. Where scans may slide
/// along one another by more than 0.3 % of the diameter, or a symmetric part's placements are not known, nothing is
/// told apart. Gives whether two were found. Errors: cancelled.
[[nodiscard]] Result<bool> separate_individuals(const RefinedComponent& component, std::vector<PosedScan>& scans,
                                                const LoadedModel& model, const io::RunRecord& record,
                                                const Context& context);

}  // namespace asbuilt::pipeline
