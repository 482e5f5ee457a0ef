// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/pipeline/options.h"

namespace asbuilt::pipeline {

/// Where a run writes, and how.
struct Output {
  std::filesystem::path folder;
  bool force = false;  ///< write into a folder that is not an earlier run of the same command, and start anew
  std::function<void(std::string_view stage, std::string_view scan)> on_stage;  ///< told as stages begin; may be empty
  /// The command as typed, for the report: without what cannot change the result (output, threads, --quiet ...).
  std::vector<std::string> arguments = {};
};

/// The whole method: scans in, the part as built and its deviations out. The folder gets what architecture.md, section
/// 4, lists; result.json last. The record says what became of every scan; its state is `failed` when none was accepted.
///
/// Errors: unwritable_output (before anything else is done, if the folder is refused), unreadable_input (the model),
/// invalid_argument, cancelled (what is finished stays in the folder, and the same call goes on from there).
[[nodiscard]] Result<io::RunRecord> reconstruct(const std::string& model_path, std::span<const std::string> scan_paths,
                                                const Options& options, const Output& output, const Context& context);

/// The half of `reconstruct` that looks at one scan at a time. `register_runs` on its folder completes it, to the same
/// bytes.
[[nodiscard]] Result<io::RunRecord> detect(const std::string& model_path, std::span<const std::string> scan_paths,
                                           const Options& options, const Output& output, const Context& context);

/// The joint half, from the folders of one or more `detect` runs with the same model. Options of the scan half are
/// those of the runs. `model_path` is given where the recorded path is no longer right. Errors: those of `reconstruct`;
/// also unreadable_input if the model's content is not the one of the runs.
[[nodiscard]] Result<io::RunRecord> register_runs(std::span<const std::string> run_folders,
                                                  const std::optional<std::string>& model_path, const Options& options,
                                                  const Output& output, const Context& context);

/// Deviations of one cloud or mesh that is in the model frame; writes the report (docs/report.md) and deviation.ply.
[[nodiscard]] Result<inspect::DeviationReport> inspect_cloud(const std::string& model_path,
                                                             const std::string& cloud_path, const Options& options,
                                                             const Output& output, const Context& context);

}  // namespace asbuilt::pipeline
