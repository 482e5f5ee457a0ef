// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/ray_scene.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/scanner.h"

namespace asbuilt::simulate {

/// The samples (in the world) that face the sensor, lie in its field and have a free way to it past `rays`.
/// Indices into `samples`, ascending.
[[nodiscard]] std::vector<std::size_t> visible_samples(std::span<const SurfacePoint> samples_in_world,
                                                       const model::RayScene& rays, const Sensor& sensor);

/// Of the samples named by `candidates`, those whose way to the sensor is blocked by `rays`.
[[nodiscard]] std::vector<std::size_t> covered_samples(std::span<const SurfacePoint> samples_in_world,
                                                       std::span<const std::size_t> candidates,
                                                       const model::RayScene& rays, const Sensor& sensor);

}  // namespace asbuilt::simulate
