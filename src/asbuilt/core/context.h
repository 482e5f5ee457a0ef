// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string_view>

namespace asbuilt {

class ThreadArena;  // defined in core/parallel.h

/// What a long stage needs of its caller: threads, progress, cancellation, a place for warnings.
/// Cheap to copy; copies share the threads. The library itself never prints.
class Context {
 public:
  /// `threads` = 0 takes as many as the machine has cores.
  explicit Context(int threads = 0);

  [[nodiscard]] ThreadArena& arena() const { return *arena_; }
  [[nodiscard]] bool cancelled() const { return stop.stop_requested(); }
  void report_progress(double share) const {
    if (progress) progress(share);
  }
  void warn(std::string_view message) const {
    if (warning) warning(message);
  }

  std::stop_token stop;                           ///< asked at least every 50 ms of work
  std::function<void(double)> progress;           ///< share of the stage that is done, in [0, 1]
  std::function<void(std::string_view)> warning;  ///< one sentence; may be called from any thread

 private:
  std::shared_ptr<ThreadArena> arena_;
};

}  // namespace asbuilt
