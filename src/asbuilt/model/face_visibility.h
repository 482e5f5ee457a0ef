// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/ray_scene.h"

namespace asbuilt::model {

/// How much of the far world a face sees from either side: 1 minus its ambient occlusion.
struct FaceVisibility {
  float front = 0.0F, back = 0.0F;  ///< share of the rays that escape; front is the side of the winding's normal
  bool is_visible = false;          ///< some spot of the face sees enough from one of its sides
};

struct VisibilityOptions {
  double occlusion_threshold = 0.97;
  int rays = 64;  ///< per spot and side
};

/// Casts cosine-weighted rays from spots on each face, from both sides, and stops as soon as a face is clearly
/// visible. Large faces are probed at several spots, since a part of them may lie inside. `rays_against` holds `mesh`.
[[nodiscard]] std::vector<FaceVisibility> face_visibility(const TriangleMesh& mesh, const RayScene& rays_against,
                                                          const VisibilityOptions& options, const Context& context);

}  // namespace asbuilt::model
