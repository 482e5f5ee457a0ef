// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gmock/gmock.h>

#include <numbers>

#include "asbuilt/core/pose.h"

namespace asbuilt::test {

/// A pose within `mm` (of its translation) and `deg` of the expected one; says by how much it misses.
MATCHER_P3(PoseNear, expected, mm, deg, "") {
  const Pose expected_pose = expected;
  const double distance_mm = (arg.translation() - expected_pose.translation()).norm();
  const double angle_deg = rotation_angle(expected_pose.linear().transpose() * arg.linear()) * 180.0 / std::numbers::pi;
  *result_listener << "which is " << distance_mm << " mm and " << angle_deg << " degrees away (allowed: " << mm
                   << " mm, " << deg << " degrees)";
  return distance_mm <= mm && angle_deg <= deg;  // false for NaN, as it should be
}

/// A Result that holds an error of this code.
MATCHER_P(FailsWith, code, "") {
  if (arg.has_value()) {
    *result_listener << "which holds a value";
    return false;
  }
  *result_listener << "which says: " << arg.error().message;
  return arg.error().code == code;
}

}  // namespace asbuilt::test
