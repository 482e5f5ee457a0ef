// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "asbuilt/core/random.h"
#include "asbuilt/fuse/fuse.h"

namespace asbuilt::test {

/// A scan of the rectangle [x0, x1] x [0, size] at height z facing up (or down), on a jittered lattice.
struct Rectangle {
  double x0 = 0.0, x1 = 20.0, size = 20.0, z = 0.0;
  bool faces_up = true;
};

inline fuse::PosedSegment scan_of(const Rectangle& r, double spacing, double sigma, int index, std::uint64_t seed) {
  fuse::PosedSegment segment;
  segment.noise_sigma_mm = sigma;
  segment.spacing_mm = spacing;
  segment.scan_index = index;
  Random random(seed, "rectangle", static_cast<std::uint64_t>(index));
  for (double x = r.x0; x < r.x1; x += spacing) {
    for (double y = 0.0; y < r.size; y += spacing) {
      const double dx = random.uniform(-0.3, 0.3) * spacing, dy = random.uniform(-0.3, 0.3) * spacing;
      segment.segment_in_scan.positions.emplace_back(static_cast<float>(x + dx), static_cast<float>(y + dy),
                                                     static_cast<float>(r.z + sigma * random.normal()));
      segment.segment_in_scan.normals.emplace_back(0.0F, 0.0F, r.faces_up ? 1.0F : -1.0F);
    }
  }
  return segment;
}

/// The same surface in a scan frame of its own.
inline fuse::PosedSegment seen_from_elsewhere(fuse::PosedSegment segment, const Pose& model_from_scan) {
  const Pose scan_from_model = model_from_scan.inverse() * segment.model_from_scan;
  for (auto& point : segment.segment_in_scan.positions) point = (scan_from_model * point.cast<double>()).cast<float>();
  for (auto& normal : segment.segment_in_scan.normals) {
    normal = (scan_from_model.linear() * normal.cast<double>()).cast<float>();
  }
  segment.model_from_scan = model_from_scan;
  return segment;
}

}  // namespace asbuilt::test
