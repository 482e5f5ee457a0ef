// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "asbuilt/core/result.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/report/report.h"

namespace asbuilt::pipeline {

/// What an inspection needs beside the cloud and the model, read from files.
struct InspectionInputs {
  inspect::InspectOptions options;  ///< with tolerances, alignment and check points filled in
  std::optional<report::InputFile> tolerance_file, reference_file;
};

/// Reads the files that the options name; before the long work, so that a mistake in them costs nothing.
/// Errors: unreadable_input, invalid_argument (an alignment that makes no sense).
[[nodiscard]] Result<InspectionInputs> inspection_inputs(const Options& options);

}  // namespace asbuilt::pipeline
