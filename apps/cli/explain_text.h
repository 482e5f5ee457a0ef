// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "asbuilt/io/run_record.h"

namespace asbuilt::cli {

/// Why an entry of a result has its status: the input, the evidence for and against its best pose with the limits that
/// applied, the runner-up, what the joint half made of it, and what the user can do. Sentences with numbers.
[[nodiscard]] std::string explanation_of(const io::RunRecord& record, std::size_t index);

}  // namespace asbuilt::cli
