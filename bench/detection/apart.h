// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "asbuilt/core/result.h"

namespace asbuilt::bench {

/// What `work` gives back, from a process of its own: code that crashes, never ends or spoils its memory costs no more
/// than its own result. `work` must not use the threads of this process (no Context).
/// Errors: not_possible if it throws, crashes or takes longer than `seconds`.
[[nodiscard]] Result<std::string> run_apart(double seconds, const std::function<std::string()>& work);

}  // namespace asbuilt::bench
