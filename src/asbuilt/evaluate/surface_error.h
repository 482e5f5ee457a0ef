// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/surface_distance.h"

namespace asbuilt::evaluate {

/// Mean exact distance to the surface of all finite points under a pose, mm; nothing is trimmed. 0 for no points.
[[nodiscard]] double mean_surface_distance(std::span<const Eigen::Vector3f> points_in_scan, const Pose& model_from_scan,
                                           const model::SurfaceDistance& surface, const Context& context);
[[nodiscard]] double mean_surface_distance(std::span<const Eigen::Vector3d> points_in_model,
                                           const model::SurfaceDistance& surface, const Context& context);

/// The rigid motion that brings points closest to a surface, found from `start` on.
///
/// Minimises the sum of a Huber loss of the exact distances by Levenberg-Marquardt, nearest points renewed in each
/// step: quadratic within `noise_mm`, where it averages the noise, absolute beyond it, as the mean distance that is
/// judged afterwards. At most 40 000 points, evenly taken from the range, take part. Deterministic.
[[nodiscard]] Pose best_motion_onto(std::span<const Eigen::Vector3d> points_in_model, const TriangleMesh& mesh,
                                    const model::SurfaceDistance& surface, double noise_mm, const Pose& start,
                                    const Context& context);

}  // namespace asbuilt::evaluate
