// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::scan {

/// What the sensor saw along its rays: the nearest depth per cell of a cube map around the viewpoint (or of a grid
/// across parallel rays). Tells free space from hidden space. Const after construction.
class DepthImage {
 public:
  enum class Evidence {
    near,     ///< something was measured at about this depth
    hidden,   ///< something stands in front: the point cannot be judged
    free,     ///< the sensor saw through this point to something behind
    unknown,  ///< no return, or an edge: nothing to learn
  };

  /// `spacing_mm` is the distance between neighbouring points at their median range. Precondition: viewpoint.known().
  DepthImage(std::span<const Eigen::Vector3f> points_in_scan, double spacing_mm, const Viewpoint& viewpoint);

  /// What the rays around a point say about matter there, give or take `tolerance_mm` along the ray.
  [[nodiscard]] Evidence evidence(const Eigen::Vector3d& point_in_scan, double tolerance_mm) const;

  /// Whether another measurement on about the same ray is nearer by more than `tolerance_mm`.
  [[nodiscard]] bool hides(const Eigen::Vector3d& point_in_scan, double tolerance_mm) const;

 private:
  struct Cell {
    int face = -1, row = 0, column = 0;
    float depth = 0.0F;
  };
  [[nodiscard]] Cell cell(const Eigen::Vector3d& point_in_scan) const;
  [[nodiscard]] float depth_at(int face, int row, int column) const;

  Viewpoint viewpoint_;
  Eigen::Vector3d across_u_, across_v_;  // parallel rays: axes of the grid
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double cells_per_length_ = 1.0;  // parallel: per mm; cube map: per unit of tan
  std::array<int, 6> rows_{}, columns_{};
  std::array<std::vector<float>, 6> depths_;  // +infinity where nothing was measured
};

}  // namespace asbuilt::scan
