// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/options.h"

#include <fmt/format.h>

#include <string_view>

namespace asbuilt::simulate {
namespace {

Result<void> check(std::string_view name, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return fail(ErrorCode::invalid_argument,
              fmt::format("{} is {}, but must be between {} and {}", name, value, low, high));
}

Result<void> check_range(std::string_view name, double low, double high) {
  if (0.0 <= low && low <= high && high <= 1.0) return {};
  return fail(ErrorCode::invalid_argument,
              fmt::format("{0}_low is {1} and {0}_high is {2}, but 0 <= low <= high <= 1 is needed", name, low, high));
}

}  // namespace

Result<void> SimulateOptions::validate() const {
  if (sensor != "structured-light" && sensor != "laser-scanner") {
    return fail(ErrorCode::invalid_argument,
                fmt::format("sensor is '{}', but must be structured-light or laser-scanner", sensor));
  }
  if (pose != "upright" && pose != "resting" && pose != "any") {
    return fail(ErrorCode::invalid_argument, fmt::format("pose is '{}', but must be upright, resting or any", pose));
  }
  ASBUILT_CHECK(check("scans", scans, 1, 10000));
  ASBUILT_CHECK(check("points", points, 100, 1e8));
  ASBUILT_CHECK(check("noise_ratio", noise_ratio, 0.0, 0.05));
  ASBUILT_CHECK(check("noise_mm", noise_mm, 0.0, 1e6));
  ASBUILT_CHECK(check("lateral_noise", lateral_noise, 0.0, 1.0));
  ASBUILT_CHECK(check("quantum", quantum, 0.0, 10.0));
  ASBUILT_CHECK(check("flying_share", flying_share, 0.0, 1.0));
  ASBUILT_CHECK(check("dropout_share", dropout_share, 0.0, 0.9));
  ASBUILT_CHECK(check("clutter_objects", clutter_objects, 0, 200));
  ASBUILT_CHECK(check_range("clutter", clutter_low, clutter_high));
  ASBUILT_CHECK(check_range("hidden", hidden_low, hidden_high));
  ASBUILT_CHECK(check("instances", instances, 1, 10));
  ASBUILT_CHECK(check("absent_share", absent_share, 0.0, 1.0));
  ASBUILT_CHECK(check("decoys", decoys, 0, 20));
  ASBUILT_CHECK(check("decoy_scale", decoy_scale, 0.1, 2.0));
  return as_built.validate();
}

}  // namespace asbuilt::simulate
