// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt::cli {

/// Puts the options of `--config FILE` in front of those that the user typed. Keys are option names, with hyphens or
/// underscores; they stand at the top of the file or in a section named for the verb. What is typed wins.
/// Errors: unreadable_input, invalid_argument (a key that the verb does not have).
[[nodiscard]] Result<std::vector<std::string>> with_config(const CLI::App& app, std::vector<std::string> arguments);

}  // namespace asbuilt::cli
