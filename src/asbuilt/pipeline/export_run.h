// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>

#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"

namespace asbuilt::pipeline {

/// Writes the result of a run so that other software can go on with it, by the extension of `output`: `.csv`, the pose
/// of each accepted scan as a row name,a11,...,a44 (model_from_scan, mm); `.e57`, the part's points of each accepted
/// scan in its own frame, with that pose, so that all together stand in the model frame. How many scans were written.
///
/// Errors: unreadable_input (a segment), not_possible (nothing was accepted), invalid_argument (another extension),
/// unwritable_output.
[[nodiscard]] Result<std::size_t> export_run(const std::filesystem::path& folder, const io::RunRecord& record,
                                             const std::filesystem::path& output);

}  // namespace asbuilt::pipeline
