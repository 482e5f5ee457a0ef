// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/inspection_inputs.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/posed_scans.h"
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

/// Graph and poses that nothing contradicts any more.
struct Registration {
  std::vector<PosedScan> scans;  ///< those that were not dropped
  graph::PoseGraph graph;        ///< nodes are indices into `scans`
  std::vector<RefinedComponent> components;
};

/// What `register_scans` does before anything is fused: links and refines the scans (as load_posed_scans gives them),
/// drops what the others contradict, and fills status, pose, graph and refinement of the record. Writes nothing.
/// Errors: not_possible, cancelled. Precondition: at least one scan.
[[nodiscard]] Result<Registration> register_poses(std::vector<PosedScan> scans, const LoadedModel& model,
                                                  const Options& options, RunFolder& folder, io::RunRecord& record,
                                                  const Context& context);

}  // namespace asbuilt::pipeline
