// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/surface_mesh.h"

namespace asbuilt::live {

/// The skin as it is shown and counted: a mesh that carries values, and what follows from it alone.
struct Surface {
  model::SurfaceMesh mesh;
  std::vector<double> area_mm2;      ///< a third of the triangles around each vertex
  std::vector<std::uint32_t> place;  ///< vertices at the same position have the same number, the lowest of them
  std::vector<std::vector<std::uint32_t>> neighbours;  ///< of each place, along edges
  std::vector<std::uint32_t> face;  ///< CAD face with most of each vertex; empty if the model knows none
  double total_area_mm2 = 0.0;
  double edge_mm = 0.0;  ///< edges are not much longer, unless the number of triangles was capped
};

[[nodiscard]] Surface surface_of(const model::PreparedModel& model);

/// What one scan says of each vertex: the signed distance from the CAD of what it measured there, mm, positive outside
/// the material; NaN where it saw nothing.
using SeenDeviation = std::vector<float>;

/// A vertex is seen where a point of the part, brought to its foot on the CAD, lies within an edge and a half (or two
/// spacings of the scan) and faces the same way within 60 degrees. `part` has oriented normals.
[[nodiscard]] SeenDeviation seen_from(const PointCloud& part_in_scan, const Pose& model_from_scan, double spacing_mm,
                                      const Surface& surface, const model::PreparedModel& model,
                                      const Context& context);

/// Share of the skin's area where `seen(vertex)`.
template <class Seen>
double area_share(const Surface& surface, const Seen& seen) {
  double sum = 0.0;
  for (std::size_t v = 0; v < surface.area_mm2.size(); ++v) {
    if (seen(v)) sum += surface.area_mm2[v];
  }
  return surface.total_area_mm2 > 0.0 ? sum / surface.total_area_mm2 : 0.0;
}

/// A connected piece of the skin that no scan has seen.
struct Hole {
  double area_mm2 = 0.0, share = 0.0, extent_mm = 0.0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< the vertex nearest to its middle
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< mean, unit length; zero if it faces all ways
  int face = -1;                                     ///< CAD face with most of it
  std::vector<std::uint32_t> vertices;
};

/// Holes of at least `smallest_share` of the skin, largest first, at most `most`.
[[nodiscard]] std::vector<Hole> holes(const Surface& surface, const std::vector<std::uint16_t>& support,
                                      double smallest_share, std::size_t most);

}  // namespace asbuilt::live
