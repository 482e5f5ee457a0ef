// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/feet.h"

#include <algorithm>

#include "asbuilt/core/cube_rows.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::inspect {
namespace {

constexpr std::size_t kGrain = 4096;
constexpr double kCubesAcross = 200.0;  // of the diameter: a cube holds a handful of triangles

}  // namespace

Result<Feet> feet_of(const PointCloud& cloud, const Pose& model_from_cloud, const model::PreparedModel& model,
                     const Context& context) {
  Feet feet;
  feet.points.resize(cloud.size());
  feet.deviation_mm.resize(cloud.size());
  feet.triangles.resize(cloud.size());
  const CubeRows cubes(cloud.positions, model.diameter / kCubesAcross);
  const auto order = cubes.order();
  ASBUILT_EXPECT(order.size() == cloud.size(), "a cloud of finite points");
  const std::size_t blocks = (order.size() + kGrain - 1) / kGrain;
  std::vector<std::size_t> on_open_edges(blocks, 0);
  parallel_for_blocks(context, order.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    if (context.cancelled()) return;
    std::uint32_t guess = 0;
    for (std::size_t place = begin; place < end; ++place) {
      const std::uint32_t i = order[place];
      const Eigen::Vector3d point = model_from_cloud * cloud.positions[i].cast<double>();
      const auto nearest =
          place == begin ? model.surface->nearest(point) : model.surface->nearest_from_guess(point, guess);
      guess = nearest.triangle;
      feet.points[i] = nearest.point.cast<float>();
      feet.deviation_mm[i] = static_cast<float>(nearest.signed_distance);
      feet.triangles[i] = nearest.triangle;
      on_open_edges[begin / kGrain] += nearest.on_open_edge ? 1 : 0;
    }
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "the inspection was interrupted");
  for (const std::size_t count : on_open_edges) feet.on_open_edges += count;
  return feet;
}

}  // namespace asbuilt::inspect
