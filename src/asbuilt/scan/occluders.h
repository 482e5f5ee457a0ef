// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/scan/depth_image.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::scan {

/// Tells where what a scan shows of a surface ends because something nearer to the sensor hides the rest. Keeps a depth
/// image, not the scan. Const after construction.
class Occluders {
 public:
  explicit Occluders(const Scan& scan);

  /// Marks (1) the points, with normals and in the frame of the scan, beside which something hides the surface: along
  /// it, up to 4 spacings to all sides, something was measured before it. Empty if the viewpoint is not known.
  [[nodiscard]] std::vector<std::uint8_t> beside(const PointCloud& part, const Context& context) const;

 private:
  std::optional<DepthImage> image_;
  SpacingByRange spacing_by_range_;
  double spacing_mm_, noise_sigma_mm_;
};

}  // namespace asbuilt::scan
