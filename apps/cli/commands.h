// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline.h"
#include "shell.h"

namespace asbuilt::cli {

// One function per verb, each in its own file.
void add_reconstruct_command(CLI::App& app, Shell& shell);
void add_detect_command(CLI::App& app, Shell& shell);
void add_register_command(CLI::App& app, Shell& shell);
void add_prepare_command(CLI::App& app, Shell& shell);
void add_inspect_command(CLI::App& app, Shell& shell);
void add_explain_command(CLI::App& app, Shell& shell);
void add_simulate_command(CLI::App& app, Shell& shell);
void add_evaluate_command(CLI::App& app, Shell& shell);
void add_export_command(CLI::App& app, Shell& shell);
void add_live_command(CLI::App& app, Shell& shell);
void add_info_command(CLI::App& app, Shell& shell);

/// What a person wants to read of a run: one line a scan, then graph, refinement, deviation and where to look.
[[nodiscard]] std::string summary_of(const io::RunRecord& record, const std::string& folder);

/// The exit code that a finished run deserves.
[[nodiscard]] int exit_code_of(const io::RunRecord& record);

/// Where a verb writes.
[[nodiscard]] pipeline::Output output_of(const std::string& folder, Shell& shell);

/// Does the work of a verb when it is called; the result decides the exit code.
void run_on_call(CLI::App& command, Shell& shell, std::function<Result<int>()> work);

}  // namespace asbuilt::cli
