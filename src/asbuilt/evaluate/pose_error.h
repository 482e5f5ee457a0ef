// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/symmetry.h"

namespace asbuilt::evaluate {

/// How far a pose is from the true one. Lengths in mm, over the vertices that triangles use.
struct PoseError {
  double angle_deg = 0.0;       ///< of the rotation between the two
  double translation_mm = 0.0;  ///< displacement of the model's centre (middle of its bounding box)
  double add_mm = 0.0;          ///< ADD: mean displacement of the vertices (Hinterstoisser 2012)
  double max_vertex_mm = 0.0;   ///< largest displacement of a vertex
  std::size_t symmetry = 0;     ///< which of the symmetries brings the two closest; 0 if none are given
};

/// Compares two poses of a part. `symmetries` holds motions that map the part onto itself (in the model frame, the
/// identity is always among them): the one that leaves the smallest largest displacement is taken.
[[nodiscard]] PoseError pose_error(const Pose& model_from_scan, const Pose& true_model_from_scan,
                                   const TriangleMesh& model, std::span<const Pose> symmetries = {});

/// The same modulo a symmetry group: the true pose is composed with the element that brings it closest to ours.
[[nodiscard]] PoseError pose_error(const Pose& model_from_scan, const Pose& true_model_from_scan,
                                   const TriangleMesh& model, const model::SymmetryGroup& group);

}  // namespace asbuilt::evaluate
