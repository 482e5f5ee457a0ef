// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::verify {

struct LmIcpOptions {
  double robust_scale_mm = 1.0;  ///< Tukey: residuals beyond it have no pull
  int max_iterations = 20;
  bool only_facing = true;  ///< only walls turned to the sensor attract (not in the paper)
};

struct LmIcpResult {
  Pose model_from_scan = Pose::Identity();
  std::size_t inliers = 0;  ///< points within the robust scale
  double rms_mm = 0.0;      ///< of the inliers
  int iterations = 0;
};

/// Residual of one point and its derivative by a left twist about `pivot`: pose_from_twist applied to x - pivot.
struct FieldResidual {
  double value = 0.0;
  Vector6d derivative = Vector6d::Zero();
};

/// From what the distance field knows of the point. Precondition: sample.known().
[[nodiscard]] FieldResidual field_residual(const model::DistanceField::Sample& sample,
                                           const Eigen::Vector3d& point_in_model,
                                           const Eigen::Vector3d& pivot_in_model);

/// A pose after a left twist about `pivot`.
[[nodiscard]] Pose stepped(const Pose& model_from_scan, const Vector6d& twist, const Eigen::Vector3d& pivot_in_model);

/// Sparse LM-ICP (Sec. 3.1; Fitzgibbon 2003): Levenberg-Marquardt on robust distances read from the distance field,
/// with analytic derivatives and no search in the loop. Normals of the scan play no part: they judge afterwards.
/// Single threaded and deterministic.
[[nodiscard]] LmIcpResult lm_icp(std::span<const Eigen::Vector3f> points_in_scan, const Pose& model_from_scan,
                                 const model::PreparedModel& model, const scan::Viewpoint& viewpoint,
                                 const LmIcpOptions& options);

}  // namespace asbuilt::verify
