// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/scanner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"

namespace asbuilt::simulate {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kAspect = 0.75;                          // height / width of a camera's field
constexpr double kLowestElevation = -60.0 / 180.0 * kPi;  // below it stands the tripod
constexpr double kDepthEdge = 0.02;                       // jump between neighbouring rays / range that makes an edge
constexpr double kLargestMixedJump = 0.5;                 // a surface much farther behind sends too little light to mix

double cos_deg(double degrees) { return std::cos(degrees / 180.0 * kPi); }

// In double from the triangle itself: Embree's float distance is too coarse beside the noise of a good sensor.
RayReturn exact_return(std::span<const TriangleMesh> meshes, const model::RayScene::Hit& hit,
                       const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const TriangleMesh& mesh = meshes[hit.mesh];
  const Eigen::Vector3d normal = doubled_area_vector(mesh, hit.triangle).normalized();
  const double slope = normal.dot(direction);
  const Eigen::Vector3d& corner = mesh.vertices[static_cast<std::size_t>(mesh.triangles[hit.triangle][0])];
  const double range = std::abs(slope) > 1e-3 ? normal.dot(corner - origin) / slope : hit.distance;
  return {range, std::abs(slope), hit.mesh};
}

// The range at which a ray on a depth edge reports a point that is not there; 0 if its neighbours make no edge. A
// surface that runs away at a flat angle also jumps from ray to ray, but not more than its own slope tells.
double mixed_range(std::span<const RayReturn> returns, const RayGrid& grid, std::size_t ray, double share) {
  const RayReturn& own = returns[ray];
  const auto columns = static_cast<std::size_t>(grid.columns);
  const double slope = std::sqrt(1.0 - std::min(1.0, own.cos_incidence * own.cos_incidence)) / own.cos_incidence;
  const double ordinary = kDepthEdge + 3.0 * grid.step * slope;
  const bool has_right = (ray + 1) % columns != 0, has_below = ray + columns < returns.size();
  for (const auto& [exists, other] : {std::pair{has_right, ray + 1}, std::pair{has_below, ray + columns}}) {
    if (!exists || returns[other].mesh == RayReturn::kNothing) continue;
    const double jump = returns[other].range_mm - own.range_mm;
    const double relative = std::abs(jump) / own.range_mm;
    if (relative > ordinary && relative < kLargestMixedJump) return own.range_mm + share * jump;
  }
  return 0.0;
}

// Two directions across a ray.
std::pair<Eigen::Vector3d, Eigen::Vector3d> across(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d first = direction.unitOrthogonal();
  return {first, direction.cross(first)};
}

}  // namespace

bool Sensor::has_in_view(const Eigen::Vector3d& point_in_world) const {
  const Eigen::Vector3d p = world_from_scan.inverse() * point_in_world;
  const double range = p.norm();
  if (range < near_mm || range > far_mm || range == 0.0) return false;
  if (kind == SensorKind::laser_scanner) return std::asin(p.z() / range) >= kLowestElevation;
  return p.z() > 0.0 && std::abs(p.x()) <= half_width * p.z() && std::abs(p.y()) <= kAspect * half_width * p.z();
}

double NoiseModel::axial_sigma(double range_mm, double cos_incidence) const {
  return sigma_mm * std::pow(range_mm / reference_mm, range_power) *
         (1.0 + incidence_growth * (1.0 / cos_incidence - 1.0));
}

double NoiseModel::return_share(double cos_incidence) const {
  const double none = cos_deg(grazing_deg), all = cos_deg(fading_deg);
  return (1.0 - dropout_share) * std::clamp((cos_incidence - none) / (all - none), 0.0, 1.0);
}

RayGrid::RayGrid(const Sensor& sensor, double step_between_rays) : kind(sensor.kind), step(step_between_rays) {
  const bool camera = kind == SensorKind::structured_light;
  left = camera ? -sensor.half_width : -kPi;
  top = camera ? -kAspect * sensor.half_width : kLowestElevation;
  const double width = camera ? 2.0 * sensor.half_width : 2.0 * kPi;
  const double height = camera ? 2.0 * kAspect * sensor.half_width : 0.5 * kPi - kLowestElevation;
  columns = std::max(1, static_cast<int>(width / step));
  rows = std::max(1, static_cast<int>(height / step));
}

Eigen::Vector3d RayGrid::direction_in_scan(std::size_t ray) const {
  const auto width = static_cast<std::size_t>(columns);
  const double x = left + step * (static_cast<double>(ray % width) + 0.5);
  const double y = top + step * (static_cast<double>(ray / width) + 0.5);
  if (kind == SensorKind::structured_light) return Eigen::Vector3d(x, y, 1.0).normalized();
  return {std::cos(y) * std::cos(x), std::cos(y) * std::sin(x), std::sin(y)};
}

double RayGrid::solid_angle(std::size_t ray) const {
  const Eigen::Vector3d direction = direction_in_scan(ray);
  if (kind == SensorKind::structured_light) return step * step * std::pow(direction.z(), 3);
  return step * step * std::hypot(direction.x(), direction.y());
}

std::vector<RayReturn> exact_returns(std::span<const TriangleMesh> meshes_in_world, const model::RayScene& rays,
                                     const Sensor& sensor, const RayGrid& grid, const Context& context) {
  std::vector<RayReturn> returns(grid.size());
  const Eigen::Vector3d origin = sensor.position_in_world();
  parallel_for(context, grid.size(), 1024, [&](std::size_t ray) {
    if (context.cancelled()) return;
    const Eigen::Vector3d direction = sensor.world_from_scan.linear() * grid.direction_in_scan(ray);
    const model::RayScene::Hit hit = rays.first_hit(origin, direction, 0.0);
    if (!hit.found()) return;
    const RayReturn exact = exact_return(meshes_in_world, hit, origin, direction);
    if (exact.range_mm >= sensor.near_mm && exact.range_mm <= sensor.far_mm) returns[ray] = exact;
  });
  return returns;
}

RayGrid grid_for(std::size_t points, std::span<const TriangleMesh> meshes_in_world, const model::RayScene& rays,
                 const Sensor& sensor, const NoiseModel& noise, const Context& context) {
  const RayGrid whole(sensor, 1e-4);  // only to learn the size of the field
  const double field = whole.step * whole.step * static_cast<double>(whole.size());
  const RayGrid coarse(sensor, std::sqrt(field / 6000.0));
  const std::vector<RayReturn> returns = exact_returns(meshes_in_world, rays, sensor, coarse, context);
  double expected = 0.0;
  for (const RayReturn& hit : returns) {
    if (hit.mesh != RayReturn::kNothing) expected += noise.return_share(hit.cos_incidence);
  }
  // At least a thousandth of the rays must return, or the grid for an empty scene would have no end.
  const double share = std::max(expected / static_cast<double>(coarse.size()), 1e-3);
  return {sensor, std::sqrt(field * share / static_cast<double>(points))};
}

RawScan measured(std::span<const RayReturn> returns, const RayGrid& grid, const NoiseModel& noise, std::uint64_t seed,
                 std::uint64_t scan, const Context& context) {
  struct Slot {
    Eigen::Vector3f point;
    std::uint32_t mesh = 0;
    bool used = false;
  };
  std::vector<Slot> slots(returns.size());
  parallel_for(context, returns.size(), 1024, [&](std::size_t ray) {
    const RayReturn& exact = returns[ray];
    if (exact.mesh == RayReturn::kNothing) return;
    Random random(seed, "ray", (scan << 40) + ray);
    if (random.uniform() >= noise.return_share(exact.cos_incidence)) return;
    double range = exact.range_mm;
    std::uint32_t mesh = exact.mesh;
    if (random.uniform() < noise.flying_share) {
      const double mixed = mixed_range(returns, grid, ray, random.uniform(0.1, 0.9));
      if (mixed > 0.0) {
        range = mixed;
        mesh = RawScan::kFlying;
      }
    }
    const double sigma = noise.axial_sigma(range, exact.cos_incidence);
    range += sigma * random.normal();
    if (noise.quantum_mm > 0.0) range = noise.quantum_mm * std::round(range / noise.quantum_mm);
    if (range <= 0.0) return;
    const Eigen::Vector3d direction = grid.direction_in_scan(ray);
    const auto [first, second] = across(direction);
    const double lateral = noise.lateral_share * sigma;
    const double along_first = lateral * random.normal(), along_second = lateral * random.normal();
    slots[ray] = {(range * direction + along_first * first + along_second * second).cast<float>(), mesh, true};
  });
  RawScan result;
  for (const Slot& slot : slots) {
    if (!slot.used) continue;
    result.points_in_scan.push_back(slot.point);
    result.mesh_of_point.push_back(slot.mesh);
  }
  return result;
}

double seen_area(std::span<const RayReturn> returns, const RayGrid& grid, const NoiseModel& noise,
                 std::uint32_t excluded) {
  const double grazing = cos_deg(noise.grazing_deg);
  double area = 0.0;
  for (std::size_t ray = 0; ray < returns.size(); ++ray) {
    const RayReturn& hit = returns[ray];
    if (hit.mesh == RayReturn::kNothing || hit.mesh == excluded || hit.cos_incidence < grazing) continue;
    area += hit.range_mm * hit.range_mm * grid.solid_angle(ray) / hit.cos_incidence;
  }
  return area;
}

}  // namespace asbuilt::simulate
