// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/distance_field.h"

#include <algorithm>
#include <cmath>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"

namespace asbuilt::model {
namespace {

constexpr double kFineBand = 4.0;     // voxels either side of the surface
constexpr double kCoarseRatio = 4.0;  // coarse voxel / fine voxel
constexpr double kMaxPlaces = 5e7;    // of bricks, in one grid

}  // namespace

DistanceField::Level::Level(const Eigen::AlignedBox3d& box, const SurfaceDistance& surface, double voxel_mm,
                            double band_mm, const Context& context)
    : voxel(static_cast<float>(voxel_mm)), inverse_voxel(1.0F / voxel) {
  const double brick_mm = kBrickCells * static_cast<double>(voxel);
  origin = box.min().array() - band_mm;
  const Eigen::Vector3d bricks = ((box.sizes().array() + 2.0 * band_mm) / brick_mm).ceil().max(1.0);
  ASBUILT_EXPECT(bricks.prod() < kMaxPlaces, "a voxel that is not tiny against the model");
  size = bricks.cast<int>();
  origin_rounded = origin.cast<float>();
  origin = origin_rounded.cast<double>();
  cells = (kBrickCells * size).cast<float>().array();

  // A brick is wanted if any of its points can be within the band.
  const auto places = static_cast<std::size_t>(size.cast<std::int64_t>().prod());
  const double wanted_within = band_mm + 0.5 * std::sqrt(3.0) * brick_mm;
  brick_at.assign(places, -1);
  parallel_for(context, places, 256, [&](std::size_t place) {
    const Eigen::Vector3d middle = corner_of(place).array() + 0.5 * brick_mm;
    if (surface.nearest(middle, wanted_within).found()) brick_at[place] = 0;
  });
  std::vector<std::size_t> place_of;
  for (std::size_t place = 0; place < places; ++place) {
    if (brick_at[place] < 0) continue;
    brick_at[place] = static_cast<std::int32_t>(place_of.size());
    place_of.push_back(place);
  }
  distance.resize(place_of.size() * kNodesPerBrick);
  triangle.resize(distance.size());
  parallel_for(context, place_of.size(), 4, [&](std::size_t brick) {
    if (!context.cancelled()) fill_brick(brick, place_of[brick], surface);
  });
  parallel_for(context, place_of.size(), 64, [&](std::size_t brick) { copy_borders(brick, place_of[brick]); });
  has_jump.resize(place_of.size());
  parallel_for(context, place_of.size(), 64, [&](std::size_t brick) { has_jump[brick] = jumps_within(brick) ? 1 : 0; });
}

// Neighbours follow one another, to and fro, so that the nearest face of the last node is a good guess for the next.
// Nodes that a later brick owns are left to copy_borders().
void DistanceField::Level::fill_brick(std::size_t brick, std::size_t place, const SurfaceDistance& surface) {
  const Eigen::Vector3d corner = corner_of(place);
  const auto step = static_cast<double>(voxel);
  std::uint32_t guess = std::numeric_limits<std::uint32_t>::max();
  for (int z = 0; z < kBrickNodes; ++z) {
    for (int y = 0; y < kBrickNodes; ++y) {
      for (int i = 0; i < kBrickNodes; ++i) {
        const int x = y % 2 == 0 ? i : kBrickCells - i;
        if (owner_of({x, y, z}, place) != place) continue;
        const auto nearest = surface.nearest_from_guess(corner + step * Eigen::Vector3d(x, y, z), guess);
        const std::size_t node = brick * kNodesPerBrick + node_index({x, y, z});
        distance[node] = static_cast<float>(nearest.signed_distance);
        triangle[node] = static_cast<std::int32_t>(nearest.triangle);
        guess = nearest.triangle;
      }
    }
  }
}

void DistanceField::Level::copy_borders(std::size_t brick, std::size_t place) {
  for (int z = 0; z < kBrickNodes; ++z) {
    for (int y = 0; y < kBrickNodes; ++y) {
      for (int x = 0; x < kBrickNodes; ++x) {
        const std::size_t owner = owner_of({x, y, z}, place);
        if (owner == place) continue;
        const std::size_t from = static_cast<std::size_t>(brick_at[owner]) * kNodesPerBrick +
                                 node_index({x % kBrickCells, y % kBrickCells, z % kBrickCells});
        const std::size_t to = brick * kNodesPerBrick + node_index({x, y, z});
        distance[to] = distance[from];
        triangle[to] = triangle[from];
      }
    }
  }
}

// Along a cell's edge a true distance cannot change by more than the edge is long.
bool DistanceField::Level::is_jump(float low, float high) const { return std::abs(high - low) > 1.001F * voxel; }

bool DistanceField::Level::jumps_within(std::size_t brick) const {
  const float* node = distance.data() + brick * kNodesPerBrick;
  for (int z = 0; z < kBrickNodes; ++z) {
    for (int y = 0; y < kBrickNodes; ++y) {
      for (int x = 0; x < kBrickNodes; ++x) {
        const float here = node[node_index({x, y, z})];
        if (x > 0 && is_jump(node[node_index({x - 1, y, z})], here)) return true;
        if (y > 0 && is_jump(node[node_index({x, y - 1, z})], here)) return true;
        if (z > 0 && is_jump(node[node_index({x, y, z - 1})], here)) return true;
      }
    }
  }
  return false;
}

// The place of the brick in whose inside (or lower border) a node lies, if there is such a brick; else `place`.
std::size_t DistanceField::Level::owner_of(const Eigen::Array3i& node, std::size_t place) const {
  const Eigen::Array3i over = node / kBrickCells;
  if ((over == 0).all()) return place;
  const auto nx = static_cast<std::size_t>(size.x()), ny = static_cast<std::size_t>(size.y());
  const Eigen::Array3i own(static_cast<int>(place % nx), static_cast<int>(place / nx % ny),
                           static_cast<int>(place / nx / ny));
  if (((own + over) >= size.array()).any()) return place;
  const std::size_t owner = place + static_cast<std::size_t>(over.x()) + nx * static_cast<std::size_t>(over.y()) +
                            nx * ny * static_cast<std::size_t>(over.z());
  return brick_at[owner] >= 0 ? owner : place;
}

std::size_t DistanceField::Level::node_index(const Eigen::Array3i& node) {
  return static_cast<std::size_t>((node.z() * kBrickNodes + node.y()) * kBrickNodes + node.x());
}

Eigen::Vector3d DistanceField::Level::corner_of(std::size_t place) const {
  const auto nx = static_cast<std::size_t>(size.x()), ny = static_cast<std::size_t>(size.y());
  const Eigen::Vector3d bricks(static_cast<double>(place % nx), static_cast<double>(place / nx % ny),
                               static_cast<double>(place / nx / ny));
  return origin + kBrickCells * static_cast<double>(voxel) * bricks;
}

template <bool kDistanceAlone>
bool DistanceField::Level::sample(const Eigen::Vector3f& point, Sample& result) const {
  const Eigen::Array3f grid = (point - origin_rounded).array() * inverse_voxel;
  if (!((grid >= 0.0F) && (grid < cells)).all()) return false;  // NaN fails here, as it should
  const Eigen::Array3i cell = grid.cast<int>();
  const Eigen::Array3f f = grid - cell.cast<float>();
  const Eigen::Array3i brick = cell / kBrickCells;
  const auto place = static_cast<std::size_t>((brick.z() * size.y() + brick.y()) * size.x() + brick.x());
  const std::int32_t index = brick_at[place];
  if (index < 0) return false;

  const Eigen::Array3i local = cell - kBrickCells * brick;
  constexpr std::size_t kRow = kBrickNodes, kLayer = kRow * kRow;
  const std::size_t base = static_cast<std::size_t>(index) * kNodesPerBrick + node_index(local);
  const Eigen::Array3i nearer = (f + 0.5F).cast<int>();
  const std::size_t nearest_node = base + static_cast<std::size_t>(nearer.x()) +
                                   kRow * static_cast<std::size_t>(nearer.y()) +
                                   kLayer * static_cast<std::size_t>(nearer.z());
  const float* d = distance.data() + base;
  float c000 = d[0], c100 = d[1], c010 = d[kRow], c110 = d[kRow + 1];
  float c001 = d[kLayer], c101 = d[kLayer + 1], c011 = d[kLayer + kRow], c111 = d[kLayer + kRow + 1];

  if (has_jump[static_cast<std::size_t>(index)] != 0 &&
      (is_jump(c000, c100) || is_jump(c010, c110) || is_jump(c001, c101) || is_jump(c011, c111) ||
       is_jump(c000, c010) || is_jump(c100, c110) || is_jump(c001, c011) || is_jump(c101, c111) ||
       is_jump(c000, c001) || is_jump(c100, c101) || is_jump(c010, c011) || is_jump(c110, c111))) {
    const float sign = distance[nearest_node] < 0.0F ? -1.0F : 1.0F;
    for (float* corner : {&c000, &c100, &c010, &c110, &c001, &c101, &c011, &c111}) *corner = sign * std::abs(*corner);
  }

  const auto between = [](float low, float high, float t) { return low + t * (high - low); };
  const float c00 = between(c000, c100, f.x()), c10 = between(c010, c110, f.x());
  const float c01 = between(c001, c101, f.x()), c11 = between(c011, c111, f.x());
  const float c0 = between(c00, c10, f.y()), c1 = between(c01, c11, f.y());
  result.distance = between(c0, c1, f.z());
  if constexpr (kDistanceAlone) return true;
  const float along_x =
      between(between(c100 - c000, c110 - c010, f.y()), between(c101 - c001, c111 - c011, f.y()), f.z());
  const float along_y = between(c10 - c00, c11 - c01, f.z());
  result.gradient = inverse_voxel * Eigen::Vector3f(along_x, along_y, c1 - c0);
  result.triangle = triangle[nearest_node];
  return true;
}

DistanceField::DistanceField(const TriangleMesh& mesh, const SurfaceDistance& surface, double voxel_mm, double reach_mm,
                             const Context& context)
    : voxel_mm_(voxel_mm), reach_mm_(reach_mm) {
  ASBUILT_EXPECT(std::isfinite(voxel_mm) && voxel_mm > 0.0, "a positive voxel");
  ASBUILT_EXPECT(std::isfinite(reach_mm) && reach_mm >= 0.0, "a reach of zero or more");
  ASBUILT_EXPECT(!mesh.empty(), "a mesh with triangles");
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  fine_ = Level(box, surface, voxel_mm, std::min(reach_mm, kFineBand * voxel_mm), context);
  if (reach_mm > kFineBand * voxel_mm) coarse_ = Level(box, surface, kCoarseRatio * voxel_mm, reach_mm, context);
}

DistanceField::Sample DistanceField::at(const Eigen::Vector3f& point_in_model) const {
  Sample result{std::numeric_limits<float>::infinity(), Eigen::Vector3f::Zero(), -1};
  const bool is_near = fine_.sample<false>(point_in_model, result) || coarse_.sample<false>(point_in_model, result);
  static_cast<void>(is_near);  // else the result stays unknown
  return result;
}

float DistanceField::distance_at(const Eigen::Vector3f& point_in_model) const {
  Sample result{std::numeric_limits<float>::infinity(), Eigen::Vector3f::Zero(), -1};
  const bool is_near = fine_.sample<true>(point_in_model, result) || coarse_.sample<true>(point_in_model, result);
  static_cast<void>(is_near);
  return result.distance;
}

std::size_t DistanceField::memory_bytes() const {
  const auto of = [](const Level& level) {
    return level.brick_at.size() * sizeof(std::int32_t) +
           level.distance.size() * (sizeof(float) + sizeof(std::int32_t));
  };
  return of(fine_) + of(coarse_);
}

}  // namespace asbuilt::model
