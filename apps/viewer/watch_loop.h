// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include "asbuilt/core/result.h"
#include "asbuilt/live/session.h"
#include "server.h"

namespace asbuilt::viewer {

struct WatchOptions {
  std::filesystem::path watch;
  ServerOptions server;
  std::chrono::milliseconds idle{1500};  ///< without a new scan, after which all scans are refined jointly
  std::chrono::milliseconds settle{60};  ///< for which a file must stand still
};

/// Told what happens; may be empty.
struct WatchReports {
  std::function<void(const Server&)> started;
  std::function<void(const live::LiveState&)> state;
};

/// What a server shows of a session, which has to outlive it.
[[nodiscard]] Content content_of(const live::LiveSession& session);

/// Serves a session over a watched folder until `stop`; then writes nothing more: the session lies on disk.
/// Errors: unreadable_input (no such folder), unwritable_output (the port is taken).
[[nodiscard]] Result<void> run_watch(live::LiveSession& session, const WatchOptions& options,
                                     const WatchReports& reports, std::stop_token stop);

}  // namespace asbuilt::viewer
