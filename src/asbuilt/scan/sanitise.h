// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"

namespace asbuilt::scan {

/// What the sanitiser removed, by reason.
struct SanitiserReport {
  std::size_t points_in = 0, not_finite = 0, no_return = 0, duplicates = 0, zero_normals = 0;
};

/// What remains of a raw cloud, and which rows it came from.
struct Sanitised {
  PointCloud cloud;  ///< finite, distinct; normals unit length, or zero where the file's was unusable
  std::vector<std::uint32_t> source_index;
  SanitiserReport report;
};

/// The one border that bad points do not cross: NaN and infinities, (0,0,0) no-returns and exact duplicates go;
/// of duplicates the first stays. Order is kept.
[[nodiscard]] Sanitised sanitise(const PointCloud& raw, const Context& context);

}  // namespace asbuilt::scan
