// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/search_points.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::pipeline {
namespace {

constexpr std::uint32_t kSpacingsAcross = 4;  // to a cube
constexpr std::uint32_t kMostInCube = kSpacingsAcross * kSpacingsAcross;
constexpr std::size_t kFewest = 20000;  // as of a scan that is thinned to fit into memory
constexpr VoxelKey kNoCube = ~VoxelKey{0};

struct Cube {
  VoxelKey key = kNoCube;
  std::uint32_t points = 0;
  std::uint32_t most_around = 0;  ///< in this cube or one that touches it
  std::uint64_t phase = 0;

  /// Of the points, in the order in which they are met, takes an even share: as much as would leave the allowed number
  /// in the fullest cube around. Where the share of a cube is less than a point, some cubes take one.
  [[nodiscard]] bool takes_next() {
    const std::uint64_t all = std::max(most_around, kMostInCube), before = phase / all;
    phase += kMostInCube;
    return phase / all > before;
  }
};

std::uint64_t mixed(VoxelKey key) { return (key * 0x9e3779b97f4a7c15U) >> 20U; }

/// Cubes by their key, open addressing.
class Cubes {
 public:
  Cube& at(VoxelKey key) {
    if (2 * occupied_ >= table_.size()) grow();
    Cube& cube = place(key);
    if (cube.key == kNoCube) {
      cube.key = key;
      ++occupied_;
    }
    return cube;
  }

  /// At most so many points will stay.
  [[nodiscard]] std::size_t most_staying() const {
    std::size_t sum = 0;
    for (const Cube& cube : table_) sum += std::min(cube.points, kMostInCube);
    return sum;
  }

  /// To be called when all points are counted, and before any is taken.
  void look_around() {
    for (Cube& cube : table_) {
      if (cube.key == kNoCube) continue;
      for (int side = 0; side < 27; ++side) {
        // Keys are biased by half their range, so that a step below cell 0 stays within its axis.
        const VoxelKey step = VoxelGrid::key_of_cell({side % 3 - 1, side / 3 % 3 - 1, side / 9 - 1}) -
                              VoxelGrid::key_of_cell(Eigen::Vector3i::Zero());
        cube.most_around = std::max(cube.most_around, place(cube.key + step).points);
      }
      cube.phase = mixed(cube.key) % std::max(cube.most_around, kMostInCube);
    }
  }

 private:
  Cube& place(VoxelKey key) {
    std::size_t at = mixed(key) & (table_.size() - 1);
    while (table_[at].key != kNoCube && table_[at].key != key) at = (at + 1) & (table_.size() - 1);
    return table_[at];
  }
  void grow() {
    const std::vector<Cube> before = std::exchange(table_, std::vector<Cube>(2 * table_.size()));
    for (const Cube& cube : before) {
      if (cube.key != kNoCube) place(cube.key) = cube;
    }
  }

  std::vector<Cube> table_ = std::vector<Cube>(1 << 12);  // a power of two
  std::size_t occupied_ = 0;
};

}  // namespace

bool is_measured(const Eigen::Vector3f& point) { return point.allFinite() && !point.isZero(0.0F); }

std::optional<std::vector<std::uint32_t>> search_points(std::span<const Eigen::Vector3f> points,
                                                        const model::PreparedModel& model,
                                                        const detect::DetectOptions& options, const Context& context) {
  if (options.search_spacing_ratio <= 0.0) return std::nullopt;
  Eigen::AlignedBox3f box;
  std::size_t measured = 0;
  for (const Eigen::Vector3f& point : points) {
    if (!is_measured(point)) continue;
    box.extend(point);
    ++measured;
  }
  if (measured < 2 * kFewest) return std::nullopt;
  const double cube_mm = kSpacingsAcross * options.search_spacing_ratio * model.sampling_distance;
  constexpr double kMostCubes = 1 << 20;  // an axis: more are another unit, or strays that make a grid of no use
  if (box.sizes().cast<double>().maxCoeff() / cube_mm >= kMostCubes) return std::nullopt;

  const VoxelGrid grid{box.min().cast<double>(), cube_mm};
  std::vector<VoxelKey> keys(points.size());
  parallel_for(context, points.size(), 1 << 14,
               [&](std::size_t i) { keys[i] = is_measured(points[i]) ? grid.key(points[i].cast<double>()) : kNoCube; });
  Cubes cubes;
  for (const VoxelKey key : keys) {
    if (key != kNoCube) ++cubes.at(key).points;
  }
  const std::size_t most = cubes.most_staying();
  if (most < kFewest || 2 * most > measured) return std::nullopt;
  cubes.look_around();
  std::vector<std::uint32_t> staying;
  staying.reserve(most);
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    if (keys[i] != kNoCube && cubes.at(keys[i]).takes_next()) staying.push_back(i);
  }
  if (staying.size() < kFewest) return std::nullopt;
  return staying;
}

Result<scan::Scan> prepare_search(const PointCloud& sought, const PointCloud& all,
                                  const std::optional<Eigen::Vector3d>& file_viewpoint,
                                  const scan::ViewpointRequest& request, const scan::ScanOptions& options,
                                  const Context& context) {
  constexpr std::size_t kDrawn = 150000;
  const bool has_all = sought.size() == all.size();
  if (has_all || file_viewpoint || !request.automatic) {
    return scan::prepare_scan(sought, file_viewpoint, request, options, context);
  }
  PointCloud draw;
  Random random(0, "search viewpoint", all.size());
  const double share = static_cast<double>(kDrawn) / static_cast<double>(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (random.uniform() >= share) continue;
    draw.positions.push_back(all.positions[i]);
    if (all.has_normals()) draw.normals.push_back(all.normals[i]);
  }
  const auto seen = scan::prepare_scan(draw, std::nullopt, request, options, context);
  if (!seen && seen.error().code == ErrorCode::cancelled) return tl::unexpected(seen.error());
  scan::ViewpointRequest decided = request;
  decided.may_be_sought = false;
  if (seen && seen->viewpoint.known()) {
    decided.automatic = false;
    decided.stated = seen->viewpoint;
  }
  auto scan = scan::prepare_scan(sought, std::nullopt, decided, options, context);
  if (!scan || decided.automatic) return scan;
  scan->viewpoint_source = seen->viewpoint_source;
  scan->warnings.insert(scan->warnings.end(), seen->warnings.begin(), seen->warnings.end());
  return scan;
}

}  // namespace asbuilt::pipeline
