// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::bench {

/// A motion that brings a part, or its mirror image, near to itself.
struct SelfMatch {
  Pose motion = Pose::Identity();
  double angle_deg = 0.0;  ///< of the rotation
  double off_share = 1.0;  ///< share of the surface that ends up more than 1 % of the diameter away from the part
};

/// Brute force: thousands of rotations about the centre of the surface, the best registered by nearest points. Without
/// `mirrored`, motions that turn by less than 15 degrees are left out. Different motions, best first, at most `most`.
/// What the suite's table of parts says of symmetry rests on this, and on nothing of the product. Some seconds a part.
[[nodiscard]] std::vector<SelfMatch> self_matches(const TriangleMesh& mesh, bool mirrored, std::size_t most,
                                                  const Context& context);

}  // namespace asbuilt::bench
