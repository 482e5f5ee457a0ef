// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/ray_scene.h"

namespace asbuilt::bench {

/// A spot on a mesh that stands for an equal share of its area, in mm.
struct Spot {
  Eigen::Vector3d position, normal;
  std::uint32_t triangle = 0;
};

/// `count` spots, stratified by area over the triangles in their order.
[[nodiscard]] std::vector<Spot> spots_on(const TriangleMesh& mesh, std::size_t count);

/// Where a scanner may stand: half of `count` evenly on a sphere of 3 diameters about the box's centre, half on one of
/// 0.75 diameters, which sees deeper into holes.
[[nodiscard]] std::vector<Eigen::Vector3d> viewpoints_around(const TriangleMesh& mesh, std::size_t count);

/// For each spot how many of the viewpoints have a free line of sight to it, counted up to `enough`. A spot on a face
/// that two bodies share (a foot on its plate) is seen by none.
[[nodiscard]] std::vector<int> views_of(const std::vector<Spot>& spots, const std::vector<Eigen::Vector3d>& viewpoints,
                                        const model::RayScene& scene, double lift_off_mm, int enough,
                                        const Context& context);

}  // namespace asbuilt::bench
