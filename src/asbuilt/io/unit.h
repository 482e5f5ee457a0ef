// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "asbuilt/core/result.h"

namespace asbuilt::io {

/// The unit of length of a file. `stated` is what the file itself says, millimetres if it says nothing.
enum class Unit { stated, millimetre, centimetre, metre, inch, foot };

/// Millimetres in one unit; 1 for `stated`.
[[nodiscard]] double millimetres_per(Unit unit);

/// "mm", "cm", "m", "inch" or "foot" (also "in", "ft"); invalid_argument otherwise.
[[nodiscard]] Result<Unit> unit_from_name(std::string_view name);
[[nodiscard]] std::string_view name_of(Unit unit);

}  // namespace asbuilt::io
