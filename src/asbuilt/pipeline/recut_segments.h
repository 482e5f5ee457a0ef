// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/fuse/fuse.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/posed_scans.h"
#include "asbuilt/pipeline/run_folder.h"

namespace asbuilt::pipeline {

/// Cuts the segments of a component anew under the refined poses (fuse/recut.h), writes the new flags into their files
/// beside those of the scan half, and gives back the parts, ready to be fused, with what colour their scans have.
/// Paper mode takes the parts as they are. Takes what the scans hold of their parts out of memory: they are read again
/// from their files, one after the other.
/// Errors: unreadable_input, unwritable_output, cancelled.
[[nodiscard]] Result<std::vector<fuse::PosedSegment>> recut_segments(const RefinedComponent& component,
                                                                     std::vector<PosedScan>& scans,
                                                                     const io::RunRecord& record,
                                                                     const Options& options, const RunFolder& folder,
                                                                     const Context& context);

/// Gives the segments of all scans outside of `kept` back the flags of the scan half: an earlier run with other options
/// may have cut them anew. Errors: unreadable_input, unwritable_output.
[[nodiscard]] Result<void> restore_segments(const std::vector<PosedScan>& kept, const io::RunRecord& record,
                                            const RunFolder& folder);

}  // namespace asbuilt::pipeline
