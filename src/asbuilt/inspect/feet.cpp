// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/feet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <span>

#include "asbuilt/core/cube_rows.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/model/surface_search.h"

namespace asbuilt::inspect {
namespace {

constexpr std::size_t kGrain = 4096;
constexpr std::size_t kMostTogether = 256;  // points that are asked for at once
constexpr double kPointsPerCube = 96.0;     // where they are dense enough; then the triangles about a cube are few
constexpr double kTrianglesPerCube = 6.0;
constexpr double kFewestCubesAcross = 100.0, kMostCubesAcross = 1000.0;  // of the diameter

/// Edge of the cubes in which points are asked for together, by how densely points and triangles cover the surface.
double cube_edge(std::size_t points, const model::PreparedModel& model) {
  const double area = model.dense_sample_area_mm2 * static_cast<double>(model.dense_samples.size());
  const double for_points = std::sqrt(kPointsPerCube * area / static_cast<double>(std::max<std::size_t>(points, 1)));
  const double for_triangles = std::sqrt(kTrianglesPerCube * area / static_cast<double>(model.skin.triangles.size()));
  return std::clamp(std::min(for_points, for_triangles), model.diameter / kMostCubesAcross,
                    model.diameter / kFewestCubesAcross);
}

}  // namespace

Result<Feet> feet_of(const PointCloud& cloud, const Pose& model_from_cloud, const model::PreparedModel& model,
                     const Context& context) {
  Feet feet;
  feet.points.resize(cloud.size());
  feet.deviation_mm.resize(cloud.size());
  feet.triangles.resize(cloud.size());
  const double edge = cube_edge(cloud.size(), model);
  const CubeRows cubes(cloud.positions, edge);
  const auto order = cubes.order();
  ASBUILT_EXPECT(order.size() == cloud.size(), "a cloud of finite points");
  const model::SurfaceSearch& surface = model.surface->search();
  const std::size_t blocks = (order.size() + kGrain - 1) / kGrain;
  std::vector<std::size_t> on_open_edges(blocks, 0);
  parallel_for_blocks(context, order.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    std::vector<Eigen::Vector3d> points(end - begin);
    for (std::size_t k = 0; k < points.size(); ++k) {
      points[k] = model_from_cloud * cloud.positions[order[begin + k]].cast<double>();
    }
    for (std::size_t from = 0, to = 0; from < points.size(); from = to) {
      to = end_of_run(from, points.size(), kMostTogether, 1.8 * edge, [&](std::size_t k) { return points[k]; });
      const auto found = surface.nearest_of_cluster(std::span(points).subspan(from, to - from));
      for (std::size_t k = from; k < to; ++k) {
        const auto& nearest = found[k - from];
        const std::uint32_t i = order[begin + k];
        feet.points[i] = nearest.point.cast<float>();
        feet.deviation_mm[i] = static_cast<float>(nearest.signed_distance);
        feet.triangles[i] = nearest.triangle;
        on_open_edges[begin / kGrain] += nearest.on_open_edge ? 1 : 0;
      }
    }
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "the inspection was interrupted");
  for (const std::size_t count : on_open_edges) feet.on_open_edges += count;
  return feet;
}

}  // namespace asbuilt::inspect
