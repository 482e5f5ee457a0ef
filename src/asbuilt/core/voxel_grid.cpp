// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/voxel_grid.h"

#include <algorithm>
#include <array>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"

namespace asbuilt {
namespace {

template <class Key>
struct KeyedPoint {
  Key key;
  std::uint32_t index;
};

// The member nearest to the members' mean: a grid's cell centre would print the grid's pattern into the subset.
template <class Key>
std::uint32_t central_member(std::span<const KeyedPoint<Key>> cube, std::span<const Eigen::Vector3f> points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& member : cube) mean += points[member.index].template cast<double>();
  mean /= static_cast<double>(cube.size());
  std::uint32_t best = cube.front().index;
  double best_distance = std::numeric_limits<double>::infinity();
  for (const auto& member : cube) {
    const double distance = (points[member.index].template cast<double>() - mean).squaredNorm();
    if (distance < best_distance) {
      best_distance = distance;
      best = member.index;
    }
  }
  return best;
}

template <class Key, class KeyOf>
std::vector<std::uint32_t> central_members(std::span<const Eigen::Vector3f> points, const Context& context,
                                           const KeyOf& key_of) {
  std::vector<KeyedPoint<Key>> keyed(points.size());
  parallel_for(context, points.size(), 1 << 14, [&](std::size_t i) {
    keyed[i] = {key_of(points[i].cast<double>()), static_cast<std::uint32_t>(i)};
  });
  stable_parallel_sort(context, keyed,
                       [](const auto& a, const auto& b) { return a.key != b.key ? a.key < b.key : a.index < b.index; });

  std::vector<std::uint32_t> subset;
  for (std::size_t begin = 0, end = 0; begin < keyed.size(); begin = end) {
    while (end < keyed.size() && keyed[end].key == keyed[begin].key) ++end;
    subset.push_back(central_member<Key>({keyed.data() + begin, end - begin}, points));
  }
  std::ranges::sort(subset);
  return subset;
}

}  // namespace

std::vector<std::uint32_t> even_subset(std::span<const Eigen::Vector3f> points, double spacing,
                                       const Context& context) {
  ASBUILT_EXPECT(spacing > 0.0, "a positive spacing");
  if (points.empty()) return {};
  Eigen::Vector3d low = points.front().cast<double>(), high = low;
  for (const Eigen::Vector3f& point : points) {
    low = low.cwiseMin(point.cast<double>());
    high = high.cwiseMax(point.cast<double>());
  }
  const VoxelGrid grid{low, spacing};
  constexpr double kCellsOfKey = 1 << 20;  // an axis, from `low` upwards
  if ((high - low).maxCoeff() / spacing < kCellsOfKey) {
    return central_members<VoxelKey>(points, context, [&](const Eigen::Vector3d& point) { return grid.key(point); });
  }
  // A stray point can stretch the box beyond any integer; doubles still tell the cubes of the others apart.
  using WideKey = std::array<double, 3>;
  return central_members<WideKey>(points, context, [&](const Eigen::Vector3d& point) {
    const Eigen::Vector3d cell = ((point - low) / spacing).array().floor();
    return WideKey{cell.z(), cell.y(), cell.x()};
  });
}

double median_spacing(std::span<const Eigen::Vector3f> points, std::size_t max_probes) {
  return median_spacing(points, KdTree(points), max_probes);
}

double median_spacing(std::span<const Eigen::Vector3f> points, const KdTree& tree, std::size_t max_probes) {
  ASBUILT_EXPECT(max_probes > 0, "at least one probe");
  ASBUILT_EXPECT(tree.size() == points.size(), "a tree over the points");
  if (points.size() < 2) return 0.0;
  const std::size_t step = std::max<std::size_t>(1, points.size() / max_probes);
  std::vector<float> distances;
  std::vector<KdTree::Neighbour> neighbours;
  for (std::size_t i = 0; i < points.size(); i += step) {
    tree.nearest(points[i], 2, neighbours);
    distances.push_back(neighbours[1].squared_distance);
  }
  return std::sqrt(static_cast<double>(median_of(std::move(distances))));
}

}  // namespace asbuilt
