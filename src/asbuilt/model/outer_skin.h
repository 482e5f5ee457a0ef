// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/face_visibility.h"

namespace asbuilt::model {

struct OuterSkin {
  TriangleMesh mesh;
  std::size_t inner_dropped = 0, flipped = 0;
  double inner_area = 0.0;  ///< mm^2 that were dropped
};

/// Drops the faces that nobody can see, unless they are a bore or pinhole in a visible surface, and turns the rest
/// outwards.
///
/// Faces are turned patch by patch, a patch being what hangs together over edges with two faces: first made
/// consistent within, then turned to the side that sees more. Where both sides see much (a sheet, a bowl), the
/// winding of most of the patch's area stays.
[[nodiscard]] OuterSkin outer_skin(const TriangleMesh& mesh, const std::vector<FaceVisibility>& visibility,
                                   bool keep_inner);

}  // namespace asbuilt::model
