// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace asbuilt::inspect {

/// What can be said of a face, a region or the part. The vocabulary is fixed.
enum class Verdict { pass, fail, not_enough_data, not_scanned };

/// "pass", "fail", "not enough data", "not scanned".
[[nodiscard]] std::string_view name_of(Verdict verdict);

}  // namespace asbuilt::inspect
