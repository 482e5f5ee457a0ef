// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/scan/scan.h"

namespace asbuilt::scan {

/// The scan in a mirror at x = 0: what a sensor would have seen of the mirror image of everything. A part found in it
/// is one whose mirror image stands in the scan.
[[nodiscard]] Scan mirrored(Scan scan);

}  // namespace asbuilt::scan
