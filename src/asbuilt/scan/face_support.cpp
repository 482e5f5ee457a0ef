// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/face_support.h"

#include <cmath>

#include "asbuilt/core/parallel.h"

namespace asbuilt::scan {
namespace {

constexpr double kLimitInSigmas = 3.0;
constexpr float kOneSurface = 0.7F;  // cosine: faces turned further against each other are no curved surface

}  // namespace

std::vector<std::uint8_t> face_support(std::span<const std::uint32_t> at, const PointCloud& cloud,
                                       std::span<const Eigen::Vector3f> faces, const KdTree& tree, const InFace& rule,
                                       const Context& context) {
  const auto limit = static_cast<float>(kLimitInSigmas * rule.noise_sigma_mm);
  const auto tilt = static_cast<float>(rule.tilt);
  std::vector<std::uint8_t> support(at.size(), 0);
  parallel_for_blocks(context, at.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f& point = cloud.positions[at[i]];
      const Eigen::Vector3f& own_face = faces[at[i]];
      tree.nearest(point, kFaceNeighbours + 1, neighbours);
      for (const KdTree::Neighbour& neighbour : neighbours) {
        if (neighbour.index == at[i]) continue;
        const Eigen::Vector3f offset = cloud.positions[neighbour.index] - point;
        const Eigen::Vector3f& face = faces[neighbour.index];
        const float room = limit + tilt * std::sqrt(neighbour.squared_distance);
        const bool in_face = std::abs(face.dot(offset)) <= room;
        const bool on_curve = rule.curved && face.dot(own_face) > kOneSurface &&
                              std::abs((face + own_face).normalized().dot(offset)) <= room;
        support[i] = static_cast<std::uint8_t>(support[i] + (in_face || on_curve ? 1 : 0));
      }
    }
  });
  return support;
}

}  // namespace asbuilt::scan
