// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/io/run_record.h"

namespace asbuilt::pipeline {

/// The entry as the scan half left it: what the joint half added or decided is taken back.
[[nodiscard]] io::ScanRecord as_detected(io::ScanRecord scan);

}  // namespace asbuilt::pipeline
