// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::model {

/// A mesh that carries values at its vertices: for pictures, and for maps of what was measured where.
/// In the model frame, mm. Invariants: `normals` is as long as `vertices` and unit length; `skin_triangles` and `faces`
/// are as long as `triangles` or empty.
struct SurfaceMesh {
  std::vector<Eigen::Vector3d> vertices;  ///< not shared across sharp edges: a value ends where its face does
  std::vector<Eigen::Vector3f> normals;   ///< smooth within what lies between sharp edges, outwards
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> skin_triangles;  ///< of the skin, that each is a piece of; empty for a thinned skin
  std::vector<std::uint32_t> faces;           ///< its CAD face; empty if the skin knows none
};

struct SurfaceMeshOptions {
  double edge_length_mm = 0.0;         ///< longer edges are split; 0: none is
  double sharp_angle_deg = 30.0;       ///< faces that are turned by more share no vertex
  std::size_t max_triangles = 150000;  ///< longer edges stay, and finer skins are thinned, to keep within it
};

/// The skin with its edges split down to a length, without gaps: both sides of an edge are split alike.
///
/// A skin of more than `max_triangles` is thinned by merging vertices within cubes, those that face alike only. It is
/// then a picture of the skin, not the skin. Same bytes every time. Cost O(n log n).
[[nodiscard]] SurfaceMesh surface_mesh(const TriangleMesh& skin, const SurfaceMeshOptions& options);

}  // namespace asbuilt::model
