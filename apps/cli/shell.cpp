// SPDX-License-Identifier: Apache-2.0
#include "shell.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace asbuilt::cli {

int exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::cancelled:
      return kInterrupted;
    case ErrorCode::unwritable_output:
      return kUnwritableOutput;
    case ErrorCode::unreadable_input:
      return kNoReadableInput;
    case ErrorCode::invalid_argument:
      return kUsage;
    case ErrorCode::not_possible:
      return kNotDone;
  }
  return kNotDone;
}

namespace {

/// What is left of a stage at the speed so far; nothing where it will soon be over, or where it is too early to tell.
std::string time_left(double share, std::chrono::duration<double> taken) {
  constexpr double kWorthTelling_s = 5.0;
  if (share < 0.03 || share >= 1.0 || taken.count() < 1.0) return {};
  const double left_s = taken.count() * (1.0 - share) / share;
  return left_s < kWorthTelling_s ? std::string() : fmt::format(", about {:.0f} s left", left_s);
}

}  // namespace

Shell::Shell(std::stop_token stop) : stop_(std::move(stop)), on_terminal_(::isatty(STDERR_FILENO) == 1) {}

Context Shell::context() {
  Context context(common.threads);
  context.stop = stop_;
  context.warning = [this](std::string_view message) { warn(message); };
  if (on_terminal_ && !common.quiet) {
    context.progress = [this](double share) { show_progress(share); };
  }
  return context;
}

void Shell::show_stage(std::string_view stage, std::string_view scan) {
  if (!on_terminal_ || common.quiet) return;
  {
    const std::lock_guard lock(mutex_);
    stage_ = scan.empty() ? std::string(stage) : fmt::format("{} {}", scan, stage);
    shown_percent_ = -1;
    stage_begin_ = std::chrono::steady_clock::now();
  }
  show_progress(0.0);
}

void Shell::show_progress(double share) {
  const std::lock_guard lock(mutex_);
  const int percent = static_cast<int>(100.0 * std::clamp(share, 0.0, 1.0));
  if (percent == shown_percent_) return;
  shown_percent_ = percent;
  const int filled = percent / 5;
  fmt::print(stderr, "\r\033[K[{:#<{}}{:->{}}] {}{}", "", filled, "", 20 - filled, stage_,
             time_left(share, std::chrono::steady_clock::now() - stage_begin_));
  std::fflush(stderr);
  line_shown_ = true;
}

void Shell::clear_line() {
  if (line_shown_) fmt::print(stderr, "\r\033[K");
  line_shown_ = false;
}

void Shell::warn(std::string_view message) {
  const std::lock_guard lock(mutex_);
  clear_line();
  fmt::print(stderr, "warning: {}\n", message);
}

void Shell::print_result(std::string_view text) {
  if (!common.quiet && !common.json) fmt::print("{}", text);
}

void Shell::print_json(std::string_view text) {
  if (common.json) fmt::print("{}", text);
}

void Shell::finish(const Error& error) {
  const std::lock_guard lock(mutex_);
  clear_line();
  fmt::print(stderr, "asbuilt: {}\n", error.message);
  exit_code_ = exit_code_of(error.code);
}

void Shell::finish(const Result<int>& outcome) {
  if (outcome) {
    finish(*outcome);
  } else {
    finish(outcome.error());
  }
}

int Shell::leave() {
  {
    const std::lock_guard lock(mutex_);
    clear_line();
  }
  const bool written = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (written || exit_code_ == kInterrupted) return exit_code_;
  fmt::print(stderr, "asbuilt: the result could not be written to standard output; is the disk full?\n");
  return kUnwritableOutput;
}

}  // namespace asbuilt::cli
