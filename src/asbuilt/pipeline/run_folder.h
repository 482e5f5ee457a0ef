// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/run_record.h"

namespace asbuilt::pipeline {

/// The output folder of one run: refuses what is not its own, keeps what is finished, and takes the time.
///
/// A folder that does not exist is made; one that exists must come from an earlier run of the same command, or `force`
/// must be given, which starts anew. timing.json, written first, tells which command a folder belongs to; result.json
/// is written at checkpoints with state "partial", and last of all when the run is complete.
class RunFolder {
 public:
  /// Errors: unwritable_output, with nothing touched.
  [[nodiscard]] static Result<RunFolder> open(const std::filesystem::path& path, std::string_view command, bool force,
                                              int threads);
  RunFolder(RunFolder&&) noexcept;
  RunFolder& operator=(RunFolder&&) noexcept;
  ~RunFolder();

  [[nodiscard]] std::filesystem::path file(const std::filesystem::path& name) const;
  [[nodiscard]] const std::string& command() const;  ///< whose folder this is

  /// What an earlier run of the same command left, if it was about this model; an error if it was about another.
  [[nodiscard]] Result<std::optional<io::RunRecord>> earlier_run(const io::ModelRecord& model) const;

  /// Writes the record as it stands. Unless `now`, so seldom that it never takes more than a twentieth of the time.
  [[nodiscard]] Result<void> checkpoint(const io::RunRecord& record, bool now = false);
  /// Takes away segments that the record does not know, writes timing.json, then the record.
  [[nodiscard]] Result<void> finish(const io::RunRecord& record);
  /// Writes timing.json alone, for commands without a record.
  [[nodiscard]] Result<void> finish();

  /// Takes away what an earlier run left and this one does not have.
  void remove(const std::filesystem::path& name) const;

  /// Takes the time of a stage until it is destroyed.
  class Stage {
   public:
    Stage(RunFolder& folder, std::string_view stage, std::string_view scan);
    ~Stage();
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

   private:
    RunFolder& folder_;
    std::string stage_, scan_;
    std::chrono::steady_clock::time_point begin_;
  };
  [[nodiscard]] Stage stage(std::string_view name, std::string_view scan = {}) { return {*this, name, scan}; }

  /// What the user typed, as far as it can change the result; for the report.
  std::vector<std::string> arguments;

  /// Told at the beginning of every stage.
  std::function<void(std::string_view stage, std::string_view scan)> on_stage;

 private:
  struct State;
  explicit RunFolder(std::unique_ptr<State> state);
  [[nodiscard]] Result<void> write_timing();

  std::unique_ptr<State> state_;
};

/// Seconds since 1970 as UTC in ISO 8601.
[[nodiscard]] std::string utc_now();

}  // namespace asbuilt::pipeline
