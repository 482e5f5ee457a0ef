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
  float hidden = 0.0F;              ///< share of its spots that see nothing
  float covered = 0.0F;             ///< the part of `hidden` over which another body lies
  bool is_visible = false;          ///< some spot of the face sees out from one of its sides
  bool is_dim = false;              ///< visible, but every spot lies above the threshold
};

struct VisibilityOptions {
  double occlusion_threshold = 0.97;
  int rays = 64;  ///< per spot and side
};

/// Casts cosine-weighted rays from spots on each face, from both sides, and stops at each spot as soon as it is clearly
/// visible. Spots that the threshold calls hidden get a second set of rays, even over the hemisphere: they count as
/// visible if a thousandth of those escapes (a thirtieth of what the threshold asks). Large faces are probed at several
/// spots, since a part of them may lie inside. `rays_against` holds `mesh`.
[[nodiscard]] std::vector<FaceVisibility> face_visibility(const TriangleMesh& mesh, const RayScene& rays_against,
                                                          const VisibilityOptions& options, const Context& context);

struct SeenMesh {
  TriangleMesh mesh;
  std::vector<FaceVisibility> visibility;
};

/// As face_visibility, but visible faces of which a part sees nothing (a plate under a foot, a wall that another meets)
/// are split first, down to edges of 1.5 % of the diameter, so that what is hidden can be told from what is seen.
[[nodiscard]] SeenMesh split_where_hidden(const TriangleMesh& mesh, const RayScene& rays_against,
                                          const VisibilityOptions& options, const Context& context);

}  // namespace asbuilt::model
