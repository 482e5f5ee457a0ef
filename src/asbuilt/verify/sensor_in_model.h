// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "asbuilt/core/pose.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::verify {

/// The sensor in the model frame of one pose, for inner loops: asks how walls are turned to it without a root per
/// point.
class SensorInModel {
 public:
  SensorInModel(const scan::Viewpoint& viewpoint, const Pose& model_from_scan) : kind_(viewpoint.kind) {
    if (kind_ == scan::Viewpoint::Kind::point) place_ = (model_from_scan * viewpoint.value).cast<float>();
    if (kind_ == scan::Viewpoint::Kind::direction) place_ = -(model_from_scan.linear() * viewpoint.value).cast<float>();
  }

  [[nodiscard]] bool known() const { return kind_ != scan::Viewpoint::Kind::none; }

  /// Whether the cosine between the normal and the direction to the sensor is more than `least`, whose sign counts.
  [[nodiscard]] bool is_turned(const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float least) const {
    const Eigen::Vector3f towards = kind_ == scan::Viewpoint::Kind::point ? Eigen::Vector3f(place_ - point) : place_;
    const float along = normal.dot(towards);
    const float squared_bound = least * least * towards.squaredNorm();
    if (least < 0.0F) return along > 0.0F || along * along < squared_bound;
    return along > 0.0F && along * along > squared_bound;
  }

 private:
  scan::Viewpoint::Kind kind_;
  Eigen::Vector3f place_ = Eigen::Vector3f::Zero();  // position, or direction towards it
};

}  // namespace asbuilt::verify
