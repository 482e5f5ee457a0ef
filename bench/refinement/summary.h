// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "asbuilt/core/result.h"

namespace asbuilt::bench {

/// Reads trials.jsonl of a folder; writes summary.json, summary.md and the pictures (SVG) beside it, and prints the
/// tables. Errors: unreadable_input, unwritable_output.
[[nodiscard]] Result<void> write_summary(const std::filesystem::path& folder);

}  // namespace asbuilt::bench
