// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// The poses that the part's near-symmetries make of one pose, as far as most of the scan points that lie on the model
/// (within `distance_mm`) stay on it: what a detection may have mistaken the pose for, or the other way round.
///
/// About an axis of near-symmetry, the angles are searched at which the points that tell angles apart fit best; where
/// no point does, one angle stands for all.
[[nodiscard]] std::vector<Pose> near_poses(const Pose& model_from_scan, std::span<const Eigen::Vector3f> points_in_scan,
                                           const model::PreparedModel& model, double distance_mm);

/// The poses that put the part's box into another of its 23 attitudes, flush with the scan points that lie on the model
/// (within `distance_mm`) or with the face on which most of these lie on a face of the model, as far as most of them
/// stay on it; the best 24. What shows only one flat face or an extrusion fits other sides of the part as well, where
/// the rest of them is hidden.
[[nodiscard]] std::vector<Pose> turned_in_box(const Pose& model_from_scan,
                                              std::span<const Eigen::Vector3f> points_in_scan,
                                              const model::PreparedModel& model, double distance_mm);

/// Unit twists, as the rows of PoseEvidence::information measure them, that the part's symmetry makes invisible: one of
/// a part of revolution, three of a sphere.
[[nodiscard]] std::vector<Vector6d> free_twists(const model::PreparedModel& model);

/// As PoseEvidence::weakest_direction(), but turns that the part's symmetry makes invisible are no loss; neither, if
/// `near_too`, those about axes of near-symmetry.
[[nodiscard]] double weakest_direction(const PoseEvidence& evidence, const model::PreparedModel& model, bool near_too);

/// Largest distance from the part's surface of that surface moved, mm; infinite beyond the field.
[[nodiscard]] double surface_moved_mm(const Pose& motion, const model::PreparedModel& model);

/// Whether every turn about an axis of near-symmetry leaves all of the surface within `ratio` of the diameter of
/// itself: then a scan may be accepted without showing its turn. False where there is no such axis.
[[nodiscard]] bool turns_are_nearly_equal(const model::PreparedModel& model, double ratio);

}  // namespace asbuilt::verify
