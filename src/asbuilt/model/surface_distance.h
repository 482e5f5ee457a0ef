// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::model {

class SurfaceSearch;

/// Exact distance from a point to a triangle mesh, in double. Built once, then const and safe from any thread.
///
/// The sign is that of the angle-weighted pseudonormal of the nearest feature (face, edge or vertex; Baerentzen and
/// Aanaes 2005): positive outside the material. Equal distances go to the lower triangle index.
class SurfaceDistance {
 public:
  struct Nearest {
    double signed_distance = std::numeric_limits<double>::infinity();  ///< mm
    Eigen::Vector3d point = Eigen::Vector3d::Zero();                   ///< nearest point of the surface
    std::uint32_t triangle = 0;
    bool on_open_edge = false;  ///< nearest to the border of an open mesh, where the sign has no meaning

    [[nodiscard]] bool found() const { return std::abs(signed_distance) < std::numeric_limits<double>::infinity(); }
  };

  /// The mesh should be welded, so that edges know both their faces. Copies what it needs.
  explicit SurfaceDistance(const TriangleMesh& mesh);
  ~SurfaceDistance();
  SurfaceDistance(SurfaceDistance&&) noexcept;
  SurfaceDistance& operator=(SurfaceDistance&&) noexcept;

  /// The nearest surface point no further than `max_distance` mm.
  [[nodiscard]] Nearest nearest(const Eigen::Vector3d& point,
                                double max_distance = std::numeric_limits<double>::infinity()) const;

  /// As nearest(point), faster if `guess` is the nearest triangle of a point close by. The answer is the same.
  [[nodiscard]] Nearest nearest_from_guess(const Eigen::Vector3d& point, std::uint32_t guess) const;

  /// What stands behind it, for callers that have many points.
  [[nodiscard]] const SurfaceSearch& search() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace asbuilt::model
