// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"

namespace asbuilt::inspect {

/// How well a scan's place is known.
struct ScanPose {
  int scan = 0;                            ///< the number that Measurement::scan uses
  Matrix6d covariance = Matrix6d::Zero();  ///< of the twist (rotation rad, translation mm) on the left of its pose
};

/// What is inspected: a cloud in the model frame and what is known of its points. Views; each span is empty or as long
/// as the cloud.
struct Measurement {
  const PointCloud& cloud;
  std::span<const std::uint16_t> scan = {};     ///< the scan that contributed most to each point
  std::span<const std::uint16_t> support = {};  ///< number of scans that saw it
  std::span<const float> sigma_mm = {};         ///< standard error of each point along its normal; 0: unknown
  std::span<const ScanPose> poses = {};         ///< of scans whose place is uncertain; any number
};

}  // namespace asbuilt::inspect
