// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/flying_points.h"

#include <algorithm>
#include <cmath>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/median.h"
#include "asbuilt/scan/face_normals.h"
#include "asbuilt/scan/face_support.h"

namespace asbuilt::verify {
namespace {

constexpr float kFarInScales = 3.0F;  // robust standard deviations of the points about the CAD
constexpr int kFewest = 5;            // neighbours in whose face a point of a surface lies
constexpr double kTilt = 0.05;        // radians; a coarser scan fits its faces worse

// Noise, pose error and as-built deviation together: 1.4826 times the median of the absolute deviations.
float scale_of(std::span<const float> deviation_mm, double noise_sigma_mm) {
  std::vector<float> absolute(deviation_mm.size());
  std::ranges::transform(deviation_mm, absolute.begin(), [](float value) { return std::abs(value); });
  return std::max(1.4826F * median_of(std::move(absolute)), static_cast<float>(noise_sigma_mm));
}

// The points `at` and their neighbours, ascending, each once.
std::vector<std::uint32_t> with_neighbours(std::span<const std::uint32_t> at, const PointCloud& cloud,
                                           const KdTree& tree) {
  std::vector<std::uint32_t> all;
  std::vector<KdTree::Neighbour> neighbours;
  for (const std::uint32_t i : at) {
    tree.nearest(cloud.positions[i], scan::kFaceNeighbours + 1, neighbours);
    for (const KdTree::Neighbour& neighbour : neighbours) all.push_back(neighbour.index);
  }
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

}  // namespace

std::vector<std::uint8_t> flying_points(std::span<const std::uint32_t> part, std::span<const float> deviation_mm,
                                        const scan::Scan& scan, const Context& context) {
  std::vector<std::uint8_t> flying(part.size(), 0);
  if (part.size() <= scan::kFaceNeighbours) return flying;
  const float far_mm = kFarInScales * scale_of(deviation_mm, scan.noise_sigma_mm);
  PointCloud cloud;
  std::vector<std::uint32_t> doubtful;
  for (std::size_t i = 0; i < part.size(); ++i) {
    cloud.positions.push_back(scan.cloud.positions[part[i]]);
    cloud.normals.push_back(scan.cloud.normals[part[i]]);
    if (std::abs(deviation_mm[i]) > far_mm) doubtful.push_back(static_cast<std::uint32_t>(i));
  }
  if (doubtful.empty()) return flying;

  const KdTree tree(cloud.positions);
  const std::vector<std::uint32_t> asked = with_neighbours(doubtful, cloud, tree);
  const std::vector<Eigen::Vector3f> fitted =
      scan::face_normals_at(asked, cloud, tree, scan.noise_sigma_mm, scan.spacing_mm, context);
  std::vector<Eigen::Vector3f> faces = cloud.normals;
  for (std::size_t i = 0; i < asked.size(); ++i) faces[asked[i]] = fitted[i];
  const std::vector<std::uint8_t> support =
      scan::face_support(doubtful, cloud, faces, tree, {.noise_sigma_mm = scan.noise_sigma_mm, .tilt = kTilt}, context);
  for (std::size_t i = 0; i < doubtful.size(); ++i) flying[doubtful[i]] = support[i] < kFewest ? 1 : 0;
  return flying;
}

}  // namespace asbuilt::verify
