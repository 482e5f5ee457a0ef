// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"

namespace asbuilt::cli {

/// The exit codes of the contract (docs/cli.md).
enum ExitCode : int {
  kDone = 0,
  kNotDone = 1,
  kUsage = 2,
  kNoReadableInput = 3,
  kUnwritableOutput = 4,
  kAmbiguousOrInPieces = 5,
  kOutOfTolerance = 6,
  kInterrupted = 130,
};
[[nodiscard]] int exit_code_of(ErrorCode code);

/// What every verb offers.
struct CommonOptions {
  int threads = 0;
  double memory_gb = 0.0;
  bool quiet = false, json = false, force = false;
};

/// Talks to the user: results on standard output, everything else on standard error, the exit code at the end.
class Shell {
 public:
  explicit Shell(std::stop_token stop);

  CommonOptions common;
  std::vector<std::string> arguments;  ///< all that was typed, options of --config put in

  /// Threads, interruption, warnings and progress as the user wants them.
  [[nodiscard]] Context context();

  /// Shows what is going on, on a terminal only.
  void show_stage(std::string_view stage, std::string_view scan);

  /// Writes a result to standard output. With --quiet only machines get one.
  void print_result(std::string_view text);
  void print_json(std::string_view text);
  void warn(std::string_view message);

  /// Ends the run with a code, or with the code and message of an error.
  void finish(int exit_code) { exit_code_ = exit_code; }
  void finish(const Error& error);
  void finish(const Result<int>& outcome);

  /// The code to leave with; also fails when standard output could not be written.
  [[nodiscard]] int leave();

 private:
  void show_progress(double share);
  void clear_line();

  std::stop_token stop_;
  int exit_code_ = kDone;
  bool on_terminal_;
  std::mutex mutex_;
  std::string stage_;
  int shown_percent_ = -1;
  bool line_shown_ = false;
  std::chrono::steady_clock::time_point stage_begin_;
};

}  // namespace asbuilt::cli
