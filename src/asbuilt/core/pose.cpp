// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/pose.h"

#include <cmath>

#include <Eigen/SVD>

#include "asbuilt/core/result.h"

namespace asbuilt {

Eigen::Matrix3d rotation_from_axis_angle(const Eigen::Vector3d& axis_angle) {
  const double angle_squared = axis_angle.squaredNorm();
  const double angle = std::sqrt(angle_squared);
  // Below 1e-4 rad the series is exact to double precision and avoids 0/0.
  const bool is_small = angle < 1e-4;
  const double sine_ratio = is_small ? 1.0 - angle_squared / 6.0 : std::sin(angle) / angle;
  const double cosine_ratio = is_small ? 0.5 - angle_squared / 24.0 : (1.0 - std::cos(angle)) / angle_squared;
  const Eigen::Matrix3d k = cross_matrix(axis_angle);
  return Eigen::Matrix3d::Identity() + sine_ratio * k + cosine_ratio * k * k;
}

Pose pose_from_twist(const Vector6d& rotation_then_translation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_axis_angle(rotation_then_translation.head<3>());
  pose.translation() = rotation_then_translation.tail<3>();
  return pose;
}

double rotation_angle(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d axis(rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                             rotation(1, 0) - rotation(0, 1));
  // atan2 of sine and cosine keeps its accuracy at both ends, where acos of the trace loses half the digits.
  return std::atan2(axis.norm(), rotation.trace() - 1.0);
}

Pose orthonormalised(const Pose& pose) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(pose.linear(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.col(2) *= -1.0;
  Pose result = pose;
  result.linear() = u * svd.matrixV().transpose();
  return result;
}

bool is_rigid(const Eigen::Matrix4d& matrix, double tolerance) {
  if (!matrix.allFinite()) return false;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool is_orthonormal =
      (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <= tolerance;
  const Eigen::RowVector4d last_row(0.0, 0.0, 0.0, 1.0);
  return is_orthonormal && rotation.determinant() > 0.0 &&
         (matrix.row(3) - last_row).cwiseAbs().maxCoeff() <= tolerance;
}

Pose best_rigid_motion(std::span<const Eigen::Vector3d> from, std::span<const Eigen::Vector3d> to,
                       std::span<const double> weights) {
  ASBUILT_EXPECT(from.size() == to.size(), "as many points to move from as to");
  ASBUILT_EXPECT(weights.empty() || weights.size() == from.size(), "one weight a point, or none");
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  double total = 0.0;
  Eigen::Vector3d from_mean = Eigen::Vector3d::Zero(), to_mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    total += weight(i);
    from_mean += weight(i) * from[i];
    to_mean += weight(i) * to[i];
  }
  if (!(total > 0.0)) return Pose::Identity();
  from_mean /= total;
  to_mean /= total;
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    correlation += weight(i) * (to[i] - to_mean) * (from[i] - from_mean).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0.0) u.col(2) *= -1.0;
  Pose pose = Pose::Identity();
  pose.linear() = u * svd.matrixV().transpose();
  pose.translation() = to_mean - pose.linear() * from_mean;
  return pose;
}

}  // namespace asbuilt
