// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "asbuilt/core/pose.h"

namespace asbuilt::refine {

/// A residual and its derivative by a left twist of the pose of p, both in the frame of the arguments, about its origin.
/// The derivative by a left twist of the pose of q is its negative: moving both by one motion leaves the residual as it
/// is.
struct ResidualWithJacobian {
  double residual = 0.0;
  Vector6d jacobian = Vector6d::Zero();  ///< rotation (mm/rad), then translation (mm/mm)
};

/// Eq. 4, d = n . (p - q), where the normal n of q turns with the pose of q; all three arguments in one frame. In the
/// common frame p and q are theta_h p and theta_k q; in q's own scan frame it reads n_q . (theta_k^-1 theta_h p - q): the
/// same number.
[[nodiscard]] inline ResidualWithJacobian point_to_plane(const Eigen::Vector3d& p, const Eigen::Vector3d& q,
                                                         const Eigen::Vector3d& normal_q) {
  ResidualWithJacobian result;
  result.residual = normal_q.dot(p - q);
  result.jacobian << p.cross(normal_q), normal_q;
  return result;
}

/// The symmetric variant, d = (n_p + n_q) / 2 . (p - q): zero for any two points of a circle, hence blind to the
/// curvature between the samples (Rusinkiewicz 2019). Each normal turns with its own point's pose.
[[nodiscard]] inline ResidualWithJacobian symmetric_point_to_plane(const Eigen::Vector3d& p,
                                                                   const Eigen::Vector3d& normal_p,
                                                                   const Eigen::Vector3d& q,
                                                                   const Eigen::Vector3d& normal_q) {
  const Eigen::Vector3d mean_normal = 0.5 * (normal_p + normal_q);
  ResidualWithJacobian result;
  result.residual = mean_normal.dot(p - q);
  result.jacobian << 0.5 * normal_p.cross(p - q) + p.cross(mean_normal), mean_normal;
  return result;
}

}  // namespace asbuilt::refine
