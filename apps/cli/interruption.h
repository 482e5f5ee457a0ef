// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stop_token>

namespace asbuilt::cli {

/// Turns Ctrl-C (and SIGTERM) into a request to stop; a second one ends the program at once, with 130.
/// Call before any other thread exists: threads inherit that they leave these signals alone.
[[nodiscard]] std::stop_token watch_for_interruption();

}  // namespace asbuilt::cli
