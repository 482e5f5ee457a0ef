// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "asbuilt/core/random.h"
#include "asbuilt/core/triangle_mesh.h"

/// Parts made by code: closed meshes in millimetres, wound outwards, vertices shared.
namespace asbuilt::simulate {

/// The demonstration part: a cast valve body of about 340 x 260 x 300 mm with three different flanges at odd angles,
/// bolt holes, bores, ribs, bosses, a lifting lug and a foot plate. It has no symmetry. `cell_mm` is the edge of its
/// facets; 4 gives some 50 000 triangles.
[[nodiscard]] TriangleMesh valve_body(double cell_mm = 4.0);

/// A block with its lowest corner at the origin's -size/2: centred.
[[nodiscard]] TriangleMesh box(const Eigen::Vector3d& size_mm);

/// Around the z axis, centred. The surface of a sphere is that of an octahedron cut in four `levels` times.
[[nodiscard]] TriangleMesh cylinder(double radius_mm, double height_mm, int segments = 48);
[[nodiscard]] TriangleMesh sphere(double radius_mm, int levels = 4);

/// A simple polygon (counter-clockwise, no holes) in the xy plane, drawn out along z, centred in z.
[[nodiscard]] TriangleMesh extruded(const std::vector<Eigen::Vector2d>& outline, double height_mm);

[[nodiscard]] TriangleMesh l_profile(double width_mm, double depth_mm, double thickness_mm, double length_mm);
[[nodiscard]] TriangleMesh i_beam(double width_mm, double depth_mm, double thickness_mm, double length_mm);
[[nodiscard]] TriangleMesh gear(double radius_mm, double thickness_mm, int teeth);

/// Three steps of different height and width: small, exact, and without symmetry.
[[nodiscard]] TriangleMesh stepped_block(double length_mm = 120.0);

/// A round flange with a neck, a bore and evenly spaced bolt holes.
[[nodiscard]] TriangleMesh flange(double radius_mm, double thickness_mm, int bolt_holes, double cell_mm);

/// A hollow quarter (or other angle) of a torus with open bore.
[[nodiscard]] TriangleMesh pipe_elbow(double bend_radius_mm, double pipe_radius_mm, double wall_mm,
                                      double angle_deg = 90.0, int segments = 32);

/// A shape for the clutter: any of the above but the valve body, proportions drawn, bounding box diagonal `size_mm`,
/// centred at the origin.
[[nodiscard]] TriangleMesh random_shape(Random& random, double size_mm);

}  // namespace asbuilt::simulate
