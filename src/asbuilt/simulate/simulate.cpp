// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/simulate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/core/random.h"
#include "asbuilt/simulate/scene.h"

namespace asbuilt::simulate {
namespace {

std::uint8_t label_of(std::uint32_t mesh) {
  if (mesh == RawScan::kFlying) return Label::kFlying;
  return static_cast<std::uint8_t>(std::min<std::uint32_t>(mesh, Label::kLastThing));
}

// Which scans show the part: as many as asked for, drawn without regard to the order.
std::vector<bool> presence(const SimulateOptions& options) {
  const auto count = static_cast<std::size_t>(options.scans);
  auto absent = static_cast<std::size_t>(std::lround(options.absent_share * options.scans));
  std::vector<bool> present(count, true);
  Random random(options.seed, "absent", 0);
  for (std::size_t i = 0; i < count; ++i) {  // selection sampling (Knuth, algorithm S)
    if (random.uniform() * static_cast<double>(count - i) >= static_cast<double>(absent)) continue;
    present[i] = false;
    --absent;
  }
  return present;
}

SimulatedScan scan_of(const Scene& scene, const SimulateOptions& options, const NoiseModel& noise, std::uint64_t index,
                      const Context& context) {
  const model::RayScene rays(scene.meshes_in_world);
  const auto points = static_cast<std::size_t>(options.points);
  const RayGrid grid = grid_for(points, scene.meshes_in_world, rays, scene.sensor, noise, context);
  const auto returns = exact_returns(scene.meshes_in_world, rays, scene.sensor, grid, context);
  const RawScan raw = measured(returns, grid, noise, options.seed, index, context);

  SimulatedScan scan;
  scan.name = fmt::format("scan_{:02}", index);
  scan.points_in_scan = raw.points_in_scan;
  for (const std::uint32_t mesh : raw.mesh_of_point) scan.labels.push_back(label_of(mesh));
  if (scene.world_from_model) scan.model_from_scan = scene.world_from_model->inverse() * scene.sensor.world_from_scan;
  for (const PlacedCopy& copy : scene.copies) {
    const auto mesh = Scene::kFirstCopy + static_cast<std::uint32_t>(scan.other_placements.size());
    scan.other_placements.push_back(
        {copy.world_from_model.inverse() * scene.sensor.world_from_scan, label_of(mesh), copy.occlusion, copy.hidden});
  }
  scan.occlusion = scene.occlusion;
  scan.hidden = scene.hidden;
  scan.clutter = scene.clutter;
  return scan;
}

}  // namespace

NoiseModel noise_model(const SimulateOptions& options, double diameter_mm) {
  NoiseModel noise;
  noise.sigma_mm = options.noise_mm > 0.0 ? options.noise_mm : options.noise_ratio * diameter_mm;
  noise.reference_mm = middle_distance_mm(options.sensor_kind(), diameter_mm);
  noise.range_power = options.sensor_kind() == SensorKind::laser_scanner ? 0.5 : 2.0;
  noise.lateral_share = options.lateral_noise;
  noise.quantum_mm = options.quantum * noise.sigma_mm;
  noise.flying_share = options.flying_share;
  noise.dropout_share = options.dropout_share;
  return noise;
}

Result<Simulation> simulate(const TriangleMesh& cad, const SimulateOptions& options, const Context& context,
                            std::span<const TriangleMesh> companions) {
  ASBUILT_CHECK(options.validate());
  ASBUILT_TRY(built, as_built(cad, options.as_built, options.seed));
  const NoiseModel noise = noise_model(options, diameter(cad));

  Simulation result{cad, std::move(built.mesh), noise.sigma_mm, built.deviation_rms_mm, built.deviation_max_mm, {}};
  const std::vector<bool> present = presence(options);
  for (std::size_t i = 0; i < present.size(); ++i) {
    const Scene scene = arrange(result.as_built, options, noise, i, present[i], context, companions);
    if (context.cancelled()) return fail(ErrorCode::cancelled, "the simulation was cancelled");
    result.scans.push_back(scan_of(scene, options, noise, i, context));
    if (context.cancelled()) return fail(ErrorCode::cancelled, "the simulation was cancelled");
    context.report_progress(static_cast<double>(i + 1) / static_cast<double>(present.size()));
  }
  return result;
}

}  // namespace asbuilt::simulate
