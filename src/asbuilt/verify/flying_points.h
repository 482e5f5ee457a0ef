// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::verify {

/// Which of the points `part` of a scan fly: one byte each, 1 where a point lies far from the CAD, as the others go,
/// and in the face of hardly any of its neighbours (scan/face_support.h).
///
/// A beam that meets two surfaces at once is measured somewhere between them. What really departs from the CAD, a boss
/// or a dent, is a surface, if only a narrow one. `deviation_mm` is the signed distance of each point from the CAD.
/// Cost: some 100 us a point that lies far from the CAD. Not in the paper.
[[nodiscard]] std::vector<std::uint8_t> flying_points(std::span<const std::uint32_t> part,
                                                      std::span<const float> deviation_mm, const scan::Scan& scan,
                                                      const Context& context);

}  // namespace asbuilt::verify
