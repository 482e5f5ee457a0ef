// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/run_folder.h"

namespace asbuilt::pipeline {

/// The half of the method that looks at one scan at a time (Sec. 3.1): read, prepare, vote, verify, cut out.
///
/// Writes segments/NNN_NAME.ply and a checkpoint after every scan; what an earlier run of the same command finished is
/// kept if file, model, options and version are the same. At most one scan is in memory. A scan that cannot be read or
/// worked on gets the status `failed`, a warning, and stops nobody else.
///
/// The record's state stays partial: whoever asked decides what completes it.
/// Errors: invalid_argument (options that name no scan), unreadable_input (the files of --poses and --viewpoint),
/// unwritable_output, cancelled.
[[nodiscard]] Result<io::RunRecord> detect_scans(const LoadedModel& model, std::span<const std::string> scan_paths,
                                                 const Options& options, RunFolder& folder, const Context& context);

}  // namespace asbuilt::pipeline
