// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/surface_normals.h"

#include <algorithm>
#include <span>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/scan/face_normals.h"

namespace asbuilt::fuse {
namespace {

constexpr float kAgree = 0.990F;  // cosine of 8 degrees
constexpr std::size_t kNeighbours = 12;
constexpr float kLimitInSigmas = 4.0F;
constexpr float kClearlyMore = 0.5F;  // neighbours; noise alone explains a little more or less

// How many neighbours lie on one surface with the point, each counting less the further off it is (Tukey's weight).
// Heights are along the mean of both normals, which is at right angles to a chord of a circle.
float explained(std::uint32_t point, std::span<const KdTree::Neighbour> neighbours, const PointCloud& cloud,
                std::span<const Eigen::Vector3f> normals, float limit) {
  float sum = 0.0F;
  for (const KdTree::Neighbour& neighbour : neighbours) {
    if (neighbour.index == point) continue;
    const Eigen::Vector3f offset = cloud.positions[neighbour.index] - cloud.positions[point];
    const float height = 0.5F * (normals[point] + normals[neighbour.index]).dot(offset) / limit;
    const float left = std::max(0.0F, 1.0F - height * height);
    sum += left * left;
  }
  return sum;
}

}  // namespace

std::vector<Eigen::Vector3f> surface_normals(const PointCloud& cloud, double noise_sigma_mm, double spacing_mm,
                                             const Context& context) {
  if (!(noise_sigma_mm > 0.0 && spacing_mm > 0.0) || cloud.size() <= kNeighbours) return cloud.normals;
  const KdTree tree(cloud.positions);
  const std::vector<Eigen::Vector3f> fitted = scan::face_normals(cloud, tree, noise_sigma_mm, spacing_mm, context);
  const float limit = kLimitInSigmas * static_cast<float>(noise_sigma_mm);
  std::vector<Eigen::Vector3f> normals = cloud.normals;
  parallel_for_blocks(context, cloud.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      if (fitted[i].dot(cloud.normals[i]) > kAgree) continue;
      tree.nearest(cloud.positions[i], kNeighbours + 1, neighbours);
      const auto point = static_cast<std::uint32_t>(i);
      const float as_given = explained(point, neighbours, cloud, cloud.normals, limit);
      if (explained(point, neighbours, cloud, fitted, limit) > as_given + kClearlyMore) normals[i] = fitted[i];
    }
  });
  return normals;
}

}  // namespace asbuilt::fuse
