// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace asbuilt {

/// A rigid motion. Frames are in variable names: `model_from_scan` takes scan points to the model frame.
using Pose = Eigen::Isometry3d;

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Rotation matrix of an axis-angle vector w (axis w/|w|, angle |w| in radians); exact near zero.
[[nodiscard]] Eigen::Matrix3d rotation_from_axis_angle(const Eigen::Vector3d& axis_angle);

/// The motion of a twist (rotation vector w in radians, translation t in mm): x -> R(w) x + t.
/// Left-multiplied as the update of a pose: `pose_from_twist(step) * pose`.
[[nodiscard]] Pose pose_from_twist(const Vector6d& rotation_then_translation);

/// Angle of a rotation in [0, pi] radians, accurate near 0 and near pi.
[[nodiscard]] double rotation_angle(const Eigen::Matrix3d& rotation);

/// The nearest rotation (polar decomposition), so that products of many poses stay rigid.
[[nodiscard]] Pose orthonormalised(const Pose& pose);

/// Whether the linear part is a proper rotation up to `tolerance` per entry and all entries are finite.
[[nodiscard]] bool is_rigid(const Eigen::Matrix4d& matrix, double tolerance = 1e-4);

/// The rigid motion that minimises sum_i w_i |pose * from_i - to_i|^2 (Kabsch/Umeyama without scale).
/// `weights` is empty or as long as the points. Needs three points that are not on a line for a unique answer.
[[nodiscard]] Pose best_rigid_motion(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                                     std::span<const double> weights = {});

[[nodiscard]] inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  return (Eigen::Matrix3d() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

}  // namespace asbuilt
