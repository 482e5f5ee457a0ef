// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/reconstruction_error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::evaluate {
namespace {

constexpr std::size_t kGrain = 512;
constexpr std::uint64_t kSampleSeed = 1;
constexpr float kSameSide = 0.0F;  // cosine: around an edge the foot may lie on the other face, never on a back side

// Where the points stand on the surface, with the normals of their faces.
PointCloud feet(std::span<const Eigen::Vector3d> points, const TriangleMesh& mesh,
                const model::SurfaceDistance& surface, const Context& context) {
  std::vector<Eigen::Vector3d> finite;
  std::ranges::copy_if(points, std::back_inserter(finite), [](const Eigen::Vector3d& p) { return p.allFinite(); });
  PointCloud cloud;
  cloud.positions.resize(finite.size());
  cloud.normals.resize(finite.size());
  parallel_for(context, finite.size(), kGrain, [&](std::size_t i) {
    const auto nearest = surface.nearest(finite[i]);
    cloud.positions[i] = nearest.point.cast<float>();
    cloud.normals[i] = doubled_area_vector(mesh, nearest.triangle).normalized().cast<float>();
  });
  return cloud;
}

std::vector<std::uint8_t> covered(const PointCloud& samples, const PointCloud& feet, double reach_mm,
                                  const Context& context) {
  std::vector<std::uint8_t> result(samples.size(), 0);
  if (feet.empty()) return result;
  const KdTree tree(feet.positions);
  const auto reach = static_cast<float>(reach_mm);
  parallel_for(context, samples.size(), kGrain, [&](std::size_t i) {
    const auto found = tree.nearest_facing(samples.positions[i], reach, feet.normals, samples.normals[i], kSameSide);
    result[i] = found.found() ? 1 : 0;
  });
  return result;
}

}  // namespace

PointsBeyond points_beyond(std::span<const Eigen::Vector3d> points, double distance_mm,
                           const model::SurfaceDistance& surface, const Context& context) {
  std::vector<std::uint8_t> is_beyond(points.size(), 0);
  parallel_for(context, points.size(), kGrain, [&](std::size_t i) {
    if (!points[i].allFinite()) return;
    is_beyond[i] = surface.nearest(points[i], distance_mm).found() ? 0 : 1;
  });
  PointsBeyond result;
  result.points = static_cast<std::size_t>(
      std::ranges::count_if(points, [](const Eigen::Vector3d& point) { return point.allFinite(); }));
  result.beyond = static_cast<std::size_t>(std::ranges::count(is_beyond, std::uint8_t{1}));
  return result;
}

double completeness(std::span<const Eigen::Vector3d> cloud, std::span<const Eigen::Vector3d> reference, double reach_mm,
                    const TriangleMesh& mesh, const model::SurfaceDistance& surface, const Context& context) {
  ASBUILT_EXPECT(reach_mm > 0.0, "a positive reach");
  const PointCloud samples = model::even_samples(mesh, 0.5 * reach_mm, kSampleSeed, context);
  const auto in_reference = covered(samples, feet(reference, mesh, surface, context), reach_mm, context);
  const auto in_cloud = covered(samples, feet(cloud, mesh, surface, context), reach_mm, context);
  std::size_t all = 0, both = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    all += in_reference[i];
    both += in_reference[i] & in_cloud[i];
  }
  return all == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(all);
}

}  // namespace asbuilt::evaluate
