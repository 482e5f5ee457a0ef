// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "asbuilt/core/random.h"
#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::simulate {

/// A rotation drawn evenly over all rotations.
[[nodiscard]] Eigen::Matrix3d random_rotation(Random& random);

/// A rotation in which the part, let go in a random attitude on a floor (-z is down), has come to rest: its centre of
/// surface is at a local minimum of height. Turned about z at random.
[[nodiscard]] Eigen::Matrix3d resting_rotation(const TriangleMesh& mesh, Random& random);

/// How far above the floor the origin of the mesh's frame stands when the rotated mesh touches the floor.
[[nodiscard]] double height_on_floor(const TriangleMesh& mesh, const Eigen::Matrix3d& world_from_mesh);

}  // namespace asbuilt::simulate
