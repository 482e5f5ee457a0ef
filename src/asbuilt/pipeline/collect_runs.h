// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/run_folder.h"

namespace asbuilt::pipeline {

/// The scans of several detect runs in one record, in the order given, their segments copied into `folder`; --exclude
/// and --accept of `options` are carried out. Model and options are those of the first run.
/// Errors: unreadable_input (no result, or an unfinished one), invalid_argument (runs with different models, a scan
/// that is not there), unwritable_output.
[[nodiscard]] Result<io::RunRecord> collect_runs(std::span<const std::string> run_folders, const Options& options,
                                                 const RunFolder& folder);

/// `chosen` for the joint half, everything else as the runs had it.
[[nodiscard]] Result<Options> joint_options(const Options& chosen, const io::RunRecord& runs);

/// --exclude and --accept as `register` writes them down, beside those of the runs.
[[nodiscard]] io::Options choices_about_scans(const Options& chosen);

/// Whether the model that was read is the one of the runs, by its content.
[[nodiscard]] Result<void> check_same_model(const LoadedModel& model, const io::RunRecord& runs);

}  // namespace asbuilt::pipeline
