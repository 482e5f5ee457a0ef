// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/mesh_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::fuse {
namespace {

constexpr std::size_t kNeighbours = 16;
constexpr float kSameFaceCosine = 0.707F;    // 45 degrees: samples of one face
constexpr float kOtherSideCosine = -0.5F;    // 120 degrees: the other side of a wall, not the next face at an edge
constexpr double kWidthInSigmas = 3.0;       // then a dozen samples within a width average noise to a tenth of it
constexpr double kWidthInCells = 0.8;        // a coarser grid asks for a smoother surface
constexpr double kWidestInBaseWidths = 3.0;  // beyond, the cloud is too sparse for a surface
constexpr float kLayerInWidths = 1.3F;       // heights over the plane of one sample that belong to its face
constexpr double kCubeInWidths = 2.56;       // holds a disc of the reach and that height
constexpr int kFewestOfSecondFace = 3;
constexpr float kEdgeDepthInWidths = 0.1F;  // how clearly an edge must be an outer or inner one

struct Neighbourhood {
  float spacing = 0.0F, sigma = 0.0F;
};

// Spacing from the share of the disc around a sample that each of its neighbours has to itself; noise from their
// heights. Only those that face alike count: a thin wall has its other side among the nearest.
Neighbourhood measured(const PointCloud& cloud, std::size_t i, std::span<const KdTree::Neighbour> neighbours) {
  float count = 0.0F, squares = 0.0F, last = 0.0F;
  for (const KdTree::Neighbour& neighbour : neighbours) {
    const std::size_t j = neighbour.index;
    last = neighbour.squared_distance;
    if (cloud.normals[i].dot(cloud.normals[j]) < kSameFaceCosine) continue;
    const float height = 0.5F * (cloud.normals[i] + cloud.normals[j]).dot(cloud.positions[j] - cloud.positions[i]);
    squares += height * height;
    count += 1.0F;
  }
  return {std::sqrt(last * std::numbers::pi_v<float> / count), std::sqrt(0.5F * squares / count)};
}

// What is measured around each sample, and the samples it was measured from.
struct Surroundings {
  std::vector<float> spacing, sigma;
  std::vector<std::array<std::uint32_t, kNeighbours + 1>> neighbours;  // itself included

  // Of the sample and its neighbours, so that a sample at a rim, which has them on one side only, or one that strays
  // from a dense cloud does not count as coarse.
  [[nodiscard]] float usual_spacing(std::size_t i) const {
    std::array<float, kNeighbours + 1> spacings{};
    std::ranges::transform(neighbours[i], spacings.begin(), [&](std::uint32_t j) { return spacing[j]; });
    std::ranges::nth_element(spacings, spacings.begin() + kNeighbours / 2);
    return spacings[kNeighbours / 2];
  }
};

Surroundings surroundings(const PointCloud& cloud, const KdTree& tree, const Context& context) {
  const std::size_t count = cloud.size();
  Surroundings around{std::vector<float>(count), std::vector<float>(count), {}};
  around.neighbours.resize(count);
  parallel_for_blocks(context, count, 1024, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      tree.nearest(cloud.positions[i], kNeighbours + 1, neighbours);
      const Neighbourhood found = measured(cloud, i, neighbours);
      around.spacing[i] = found.spacing;
      around.sigma[i] = found.sigma;
      std::ranges::transform(neighbours, around.neighbours[i].begin(), &KdTree::Neighbour::index);
    }
  });
  return around;
}

float sigma_around(const PointCloud& cloud, std::size_t i, const KdTree& tree, double radius,
                   std::vector<KdTree::Neighbour>& neighbours) {
  tree.within(cloud.positions[i], static_cast<float>(radius), neighbours);
  return measured(cloud, i, neighbours).sigma;
}

// The nearest neighbours of a sample in a cloud thicker than its spacing are a ball within that thickness, and say too
// little of it. So the noise is measured again in balls of its own size until it grows no more.
double noise_of(const PointCloud& cloud, const KdTree& tree, double sigma, double spacing) {
  constexpr std::size_t kProbes = 300;
  constexpr int kMostRounds = 6;
  const std::size_t step = std::max<std::size_t>(1, cloud.size() / kProbes);
  std::vector<KdTree::Neighbour> neighbours;
  for (int round = 0; round < kMostRounds && kWidthInSigmas * sigma > spacing; ++round) {
    std::vector<float> sigmas;
    for (std::size_t i = step / 2; i < cloud.size(); i += step) {
      sigmas.push_back(sigma_around(cloud, i, tree, 6.0 * sigma, neighbours));
    }
    const auto found = static_cast<double>(median_of(std::move(sigmas)));
    if (found < 1.02 * sigma) return std::max(found, sigma);
    sigma = found;
  }
  return sigma;
}

PointCloud in_order_of_place(const PointCloud& cloud, double cube_mm, const Context& context) {
  Eigen::Vector3f low = cloud.positions.front();
  for (const Eigen::Vector3f& point : cloud.positions) low = low.cwiseMin(point);
  const VoxelGrid grid{low.cast<double>(), cube_mm};
  std::vector<std::pair<VoxelKey, std::uint32_t>> keyed(cloud.size());
  parallel_for(context, cloud.size(), 1 << 14, [&](std::size_t i) {
    keyed[i] = {grid.key(cloud.positions[i].cast<double>()), static_cast<std::uint32_t>(i)};
  });
  stable_parallel_sort(context, keyed, std::less<>{});
  PointCloud sorted;
  sorted.positions.reserve(cloud.size());
  sorted.normals.reserve(cloud.size());
  for (const auto& [key, index] : keyed) {
    sorted.positions.push_back(cloud.positions[index]);
    sorted.normals.push_back(cloud.normals[index].normalized());
  }
  return sorted;
}

// One face near a place: the weighted mean of the samples that face like `facing`.
struct Face {
  float weight = 0.0F, height = 0.0F;
  int count = 0;
  Eigen::Vector3f normal = Eigen::Vector3f::Zero(), centre = Eigen::Vector3f::Zero();  // centre from the place
};

float facing_weight(const Eigen::Vector3f& normal, const Eigen::Vector3f& facing) {
  return std::max(0.0F, (normal.dot(facing) - kSameFaceCosine) / (1.0F - kSameFaceCosine));
}

Face face_at(const PointCloud& cloud, const Eigen::Vector3f& place, const Eigen::Vector3f& facing,
             const SurfaceField::Scratch& near) {
  Face face;
  float own_planes = 0.0F;
  for (const auto& [index, closeness] : near) {
    const float kernel = closeness * closeness * closeness;  // near a Gaussian, but ends where the samples do
    const float weight = kernel * facing_weight(cloud.normals[index], facing);
    if (!(weight > 0.0F)) continue;
    const Eigen::Vector3f offset = cloud.positions[index] - place;
    face.weight += weight;
    face.count += 1;
    face.normal += weight * cloud.normals[index];
    face.centre += weight * offset;
    own_planes -= weight * cloud.normals[index].dot(offset);
  }
  if (face.count == 0) return face;
  face.normal.normalize();
  face.centre /= face.weight;
  face.height = 0.5F * (own_planes / face.weight - face.normal.dot(face.centre));
  return face;
}

// The sample nearest to `place` that belongs to neither `face` nor the other side of the wall.
const SurfaceField::Near* next_face(const PointCloud& cloud, const Eigen::Vector3f& place,
                                    const Eigen::Vector3f& facing, const SurfaceField::Scratch& near) {
  const SurfaceField::Near* best = nullptr;
  float best_distance = std::numeric_limits<float>::infinity();
  for (const SurfaceField::Near& sample : near) {
    const float cosine = cloud.normals[sample.index].dot(facing);
    if (cosine > kSameFaceCosine || cosine < kOtherSideCosine) continue;
    const float distance = (cloud.positions[sample.index] - place).squaredNorm();
    if (distance < best_distance) {
      best_distance = distance;
      best = &sample;
    }
  }
  return best;
}

enum class Edge { none, outer, inner };

Edge edge_between(const Face& a, const Face& b, float width) {
  const float depth = kEdgeDepthInWidths * width;
  const float b_over_a = a.normal.dot(b.centre - a.centre), a_over_b = b.normal.dot(a.centre - b.centre);
  if (b_over_a < -depth && a_over_b < -depth) return Edge::outer;
  if (b_over_a > depth && a_over_b > depth) return Edge::inner;
  return Edge::none;
}

void measure_support(FieldValue& value, const PointCloud& cloud, const Eigen::Vector3f& place, float width,
                     const SurfaceField::Scratch& near) {
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();
  float total = 0.0F, nearest = std::numeric_limits<float>::infinity();
  for (const auto& [index, weight] : near) {  // not cubed: the more samples count, the less chance is in it
    if (cloud.normals[index].dot(value.normal) < kOtherSideCosine) continue;
    const Eigen::Vector3f offset = cloud.positions[index] - place;
    const float distance = offset.norm();
    nearest = std::min(nearest, distance);
    value.samples += 1;
    if (distance > 0.0F) direction += (weight / distance) * offset;
    total += weight;
  }
  value.nearest = nearest / width;
  value.imbalance = total > 0.0F ? direction.norm() / total : 1.0F;
}

}  // namespace

FieldSamples field_samples(const PointCloud& cloud, double known_sigma_mm, double cell_mm, const Context& context) {
  FieldSamples samples;
  const double spacing = median_spacing(cloud.positions);
  if (!(spacing > 0.0)) return samples;
  samples.cloud = in_order_of_place(cloud, 2.0 * spacing, context);
  const KdTree tree(samples.cloud.positions);
  const Surroundings around = surroundings(samples.cloud, tree, context);
  if (context.cancelled()) return samples;
  const auto local_spacing = static_cast<double>(median_of(around.spacing));
  const auto local_sigma = static_cast<double>(median_of(around.sigma));
  const double noise = std::max(known_sigma_mm, noise_of(samples.cloud, tree, local_sigma, local_spacing));
  samples.base_width_mm = std::max({local_spacing, kWidthInSigmas * noise, kWidthInCells * cell_mm});
  const auto base = static_cast<float>(samples.base_width_mm);
  samples.width_mm.resize(cloud.size());
  parallel_for(context, cloud.size(), 4096, [&](std::size_t i) {
    samples.width_mm[i] = std::clamp(around.usual_spacing(i), base, base * static_cast<float>(kWidestInBaseWidths));
  });
  return samples;
}

SurfaceField::SurfaceField(const FieldSamples& samples, const Context& context)
    : samples_(samples),
      fine_(samples.cloud.positions, kCubeInWidths * samples.base_width_mm, context),
      coarse_(samples.cloud.positions, kCubeInWidths * static_cast<double>(*std::ranges::max_element(samples.width_mm)),
              context) {}

std::optional<FieldValue> SurfaceField::at(const Eigen::Vector3f& place, std::uint32_t reference,
                                           Scratch& scratch) const {
  const PointCloud& cloud = samples_.cloud;
  const float width = samples_.width_mm[reference];
  const Eigen::Vector3f& facing = cloud.normals[reference];
  const Eigen::Vector3f foot = place - facing.dot(place - cloud.positions[reference]) * facing;
  const float squared_reach = (kReachInWidths * width) * (kReachInWidths * width), layer = kLayerInWidths * width;
  scratch.clear();
  const auto gather = [&](std::uint32_t j) {
    const Eigen::Vector3f offset = cloud.positions[j] - foot;
    // Heights within the layer have no say in the weight: else every place would find samples of its own height.
    const float height = facing.dot(offset), squared = offset.squaredNorm() - height * height;
    if (squared >= squared_reach || std::abs(height) > layer) return false;
    scratch.push_back({j, 1.0F - squared / squared_reach});
    return false;
  };
  const bool is_fine = width <= static_cast<float>(samples_.base_width_mm);
  is_fine ? fine_.around_until(foot, gather) : coarse_.around_until(foot, gather);

  const Face face = face_at(cloud, place, facing, scratch);
  if (face.count == 0) return std::nullopt;
  FieldValue value;
  value.height = face.height;
  value.normal = face.normal;
  if (const Near* other = next_face(cloud, place, face.normal, scratch)) {
    const Face second = face_at(cloud, place, cloud.normals[other->index], scratch);
    const Edge edge = second.count < kFewestOfSecondFace ? Edge::none : edge_between(face, second, width);
    if ((edge == Edge::outer && second.height > face.height) || (edge == Edge::inner && second.height < face.height)) {
      value.height = second.height;
      value.normal = second.normal;
    }
  }
  measure_support(value, cloud, place, width, scratch);
  return value;
}

}  // namespace asbuilt::fuse
