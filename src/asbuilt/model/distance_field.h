// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/model/surface_distance.h"

namespace asbuilt::model {

/// Signed distance to the skin on a grid, stored in sparse 8x8x8 bricks near the surface; trilinear in between.
/// Lookup is a few loads and no search, which is what LM-ICP's inner loop needs (Sec. 3.1; Fitzgibbon 2003).
///
/// Two grids: `voxel_mm` within four voxels of the surface, four times as coarse from there to the reach.
///
/// Where the sign jumps though the surface is not near (beyond the border of an open mesh, between two faces that
/// disagree), neighbouring grid nodes differ by more than their distance. In such a cell the magnitudes are
/// interpolated, with the sign of the nearest node, so that a squared residual stays what it should be.
class DistanceField {
 public:
  struct Sample {
    float distance;            ///< signed, mm; +infinity further than `reach()` from the surface
    Eigen::Vector3f gradient;  ///< of the trilinear interpolant, so it is the distance's exact derivative
    std::int32_t triangle;     ///< nearest face of the nearest grid node, or -1

    [[nodiscard]] bool known() const { return triangle >= 0; }
  };

  /// Samples `surface` within `reach_mm` of it (rounded up to whole bricks) at `voxel_mm`.
  DistanceField(const TriangleMesh& mesh, const SurfaceDistance& surface, double voxel_mm, double reach_mm,
                const Context& context);

  [[nodiscard]] Sample at(const Eigen::Vector3f& point_in_model) const;
  /// at().distance, in two thirds of the time.
  [[nodiscard]] float distance_at(const Eigen::Vector3f& point_in_model) const;
  [[nodiscard]] double voxel_mm() const { return voxel_mm_; }
  [[nodiscard]] double reach_mm() const { return reach_mm_; }
  [[nodiscard]] std::size_t memory_bytes() const;

  static constexpr int kBrickCells = 8;  ///< cells of a brick along an axis; it stores one node more
  static constexpr int kBrickNodes = kBrickCells + 1;
  static constexpr std::size_t kNodesPerBrick = static_cast<std::size_t>(kBrickNodes) * kBrickNodes * kBrickNodes;

 private:
  /// Bricks own their border nodes, so a lookup reads one brick only.
  struct Level {
    Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // a float's value, so that building and looking up agree
    Eigen::Vector3f origin_rounded = Eigen::Vector3f::Zero();
    Eigen::Array3f cells = Eigen::Array3f::Zero();   // the grid's size in cells
    Eigen::Vector3i size = Eigen::Vector3i::Zero();  // in bricks
    float voxel = 1.0F, inverse_voxel = 1.0F;
    std::vector<std::int32_t> brick_at;  // per place: index of its brick or -1; x runs fastest
    std::vector<float> distance;         // kNodesPerBrick a brick; x runs fastest
    std::vector<std::int32_t> triangle;
    std::vector<std::uint8_t> has_jump;  // per brick: whether the sign jumps within it though the surface is not near

    Level() = default;
    Level(const Eigen::AlignedBox3d& box, const SurfaceDistance& surface, double voxel_mm, double band_mm,
          const Context& context);
    void fill_brick(std::size_t brick, std::size_t place, const SurfaceDistance& surface);
    void copy_borders(std::size_t brick, std::size_t place);
    [[nodiscard]] bool jumps_within(std::size_t brick) const;
    [[nodiscard]] bool is_jump(float low, float high) const;
    [[nodiscard]] std::size_t owner_of(const Eigen::Array3i& node, std::size_t place) const;
    [[nodiscard]] Eigen::Vector3d corner_of(std::size_t place) const;
    [[nodiscard]] static std::size_t node_index(const Eigen::Array3i& node);
    template <bool kDistanceAlone>
    [[nodiscard]] bool sample(const Eigen::Vector3f& point, Sample& result) const;
  };

  Level fine_, coarse_;
  double voxel_mm_ = 0.0, reach_mm_ = 0.0;
};

}  // namespace asbuilt::model
