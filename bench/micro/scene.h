// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "asbuilt/core/pose.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::bench {

/// What the kernels of the later stages are timed on: the demonstration part and one scan of it alone, made once.
struct Scene {
  model::PreparedModel model;
  std::shared_ptr<const detect::Codebook> codebook;
  scan::Scan scan;
  Pose model_from_scan = Pose::Identity();  ///< the true pose
};

[[nodiscard]] const Scene& scene();

/// Rays from a sensor at `eye_in_model` that looks at the model's middle: `side` x `side` of them, with `noise_mm`
/// along each. Points in the sensor's frame, sensor at the origin.
[[nodiscard]] PointCloud rays_onto(const model::PreparedModel& model, const Eigen::Vector3d& eye_in_model, int side,
                                   double noise_mm, Pose& model_from_scan);

}  // namespace asbuilt::bench
