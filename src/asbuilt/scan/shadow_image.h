// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

namespace asbuilt::scan {

/// How well what the front surfaces hide agrees with what is missing behind them, as seen from a place. From where the
/// scan was taken hardly anything hides; gaps are also left by what returned nothing.
struct Shadows {
  double hidden = 0.0;  ///< points behind others / points
  double gaps = 0.0;    ///< empty cells between a surface and one behind it / cells in which something was measured

  [[nodiscard]] double misfit() const { return 3.0 * hidden + gaps; }
};

/// The difference in depth from which a surface is another one, and not the same, slanted or noisy.
struct DepthJump {
  float share_of_depth = 0.0F, least_mm = 0.0F;

  [[nodiscard]] bool is_between(float near_mm, float far_mm) const {
    const float least = share_of_depth * near_mm;
    return far_mm - near_mm > (least > least_mm ? least : least_mm);
  }
};

/// Depths in cells of even tangents on the six sides of a cube around a place, no larger than what was measured. Made
/// for looking at the same points from many places: keeps its memory. Not to be used by two threads at once.
class ShadowImage {
 public:
  /// `points` must outlive it.
  explicit ShadowImage(std::span<const Eigen::Vector3f> points) : points_(points), place_(points.size()) {}

  /// `cell` is the width of a cell as a tangent: 1.5 times the angle between neighbouring measurements leaves hardly a
  /// cell of a continuous surface empty. Where strays far aside, or a very narrow field of view, would make more than
  /// some eight cells a point of it, cells are wider, and so is the jump in depth.
  [[nodiscard]] Shadows seen_from(const Eigen::Vector3d& position, double cell, const DepthJump& least_jump);

 private:
  struct Place {
    int side, row, column;
    float depth;
  };
  struct Side {
    std::size_t count = 0;
    int first_row = 0, last_row = 0, first_column = 0, last_column = 0;
    std::vector<float> depths;  // infinity where nothing was measured

    [[nodiscard]] int rows() const { return last_row - first_row + 1; }
    [[nodiscard]] int columns() const { return last_column - first_column + 1; }
    [[nodiscard]] float& at(int row, int column) {
      return depths[static_cast<std::size_t>(row - first_row) * static_cast<std::size_t>(columns()) +
                    static_cast<std::size_t>(column - first_column)];
    }
  };
  void project(const Eigen::Vector3d& from, int across);
  [[nodiscard]] double cells() const;
  void fill(Side& image, int side);
  static std::size_t add_gaps(Side& image, const DepthJump& jump, double& gaps);

  std::span<const Eigen::Vector3f> points_;
  std::vector<Place> place_;
  std::array<Side, 6> sides_;
};

}  // namespace asbuilt::scan
