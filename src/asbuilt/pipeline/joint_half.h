// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/inspection_inputs.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/run_folder.h"

namespace asbuilt::pipeline {

/// The half of the method that looks at all scans together (Sec. 3.2 and after): pose graph, joint refinement without
/// the CAD, gauge, fusion, deviations. Fills the record of a scan half and writes reconstruction.ply, the report and,
/// if wanted, mesh.ply into the folder, which already holds the segments.
///
/// What the others contradict is dropped and the rest done again. Without an accepted scan the record's state is
/// `failed` and nothing else is written; otherwise it is `complete`. Does not write the record itself.
/// Errors: unreadable_input (a segment is missing), unwritable_output, not_possible, cancelled.
[[nodiscard]] Result<void> register_scans(const LoadedModel& model, const Options& options,
                                          const InspectionInputs& inputs, RunFolder& folder, io::RunRecord& record,
                                          const Context& context);

}  // namespace asbuilt::pipeline
