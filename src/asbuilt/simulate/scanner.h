// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/model/ray_scene.h"

namespace asbuilt::simulate {

enum class SensorKind {
  structured_light,  ///< a camera: perspective grid along +z (x right, y down), limited field and depth
  laser_scanner,     ///< a tripod: grid of equal angles all around the z axis, from 60 degrees below the horizon up
};

/// A sensor at the origin of its own frame, the scan frame, standing in the world.
struct Sensor {
  SensorKind kind = SensorKind::structured_light;
  Pose world_from_scan = Pose::Identity();
  double half_width = 0.45;  ///< structured light: tangent of half the horizontal field; its height is 3/4 of it
  double near_mm = 0.0;      ///< nothing nearer or farther is measured
  double far_mm = std::numeric_limits<double>::infinity();

  [[nodiscard]] Eigen::Vector3d position_in_world() const { return world_from_scan.translation(); }
  /// Whether a point lies in the field and within reach (not whether the way there is free).
  [[nodiscard]] bool has_in_view(const Eigen::Vector3d& point_in_world) const;
};

/// How a measured range errs. The range itself errs by a normal deviate of axial_sigma() along the ray, is rounded to
/// the quantum, and the point is moved across the ray by a normal deviate of lateral_share * axial_sigma().
struct NoiseModel {
  double sigma_mm = 0.0;         ///< straight on, at the reference range
  double reference_mm = 1000.0;  ///< middle of the working range
  double range_power = 2.0;  ///< sigma grows with (range / reference)^this: 2 by triangulation, 1/2 by time of flight
  double incidence_growth = 0.3;  ///< sigma grows by this for each unit of 1 / cos(incidence)
  double lateral_share = 0.25;
  double quantum_mm = 0.0;
  double flying_share = 0.0;   ///< of the rays at a depth edge, these give a point between the two surfaces
  double dropout_share = 0.0;  ///< of all rays, these give nothing
  double fading_deg = 68.0;    ///< incidence from which more and more rays give nothing ...
  double grazing_deg = 84.0;   ///< ... and from which all do

  [[nodiscard]] double axial_sigma(double range_mm, double cos_incidence) const;
  /// Probability that the surface sends back enough light.
  [[nodiscard]] double return_share(double cos_incidence) const;
};

/// Rays of a sensor: `columns` x `rows`, equally spaced in the image plane or in angle.
struct RayGrid {
  SensorKind kind = SensorKind::structured_light;
  double step = 0.01, left = 0.0, top = 0.0;  ///< in the image plane at distance 1, or radians
  int columns = 0, rows = 0;

  /// A grid over the whole field of the sensor.
  RayGrid(const Sensor& sensor, double step_between_rays);
  [[nodiscard]] std::size_t size() const { return static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); }
  [[nodiscard]] Eigen::Vector3d direction_in_scan(std::size_t ray) const;  ///< unit length
  [[nodiscard]] double solid_angle(std::size_t ray) const;
};

/// What one ray met. `mesh` is kNothing where it met nothing in reach.
struct RayReturn {
  static constexpr std::uint32_t kNothing = std::numeric_limits<std::uint32_t>::max();
  double range_mm = std::numeric_limits<double>::infinity();
  double cos_incidence = 0.0;
  std::uint32_t mesh = kNothing;
};

/// Measured points in the scan frame and the mesh that each lies on, row by row.
struct RawScan {
  static constexpr std::uint32_t kFlying = std::numeric_limits<std::uint32_t>::max();
  std::vector<Eigen::Vector3f> points_in_scan;
  std::vector<std::uint32_t> mesh_of_point;
};

/// The exact first hits of all rays of a grid. `rays` must have been built from `meshes_in_world`.
[[nodiscard]] std::vector<RayReturn> exact_returns(std::span<const TriangleMesh> meshes_in_world,
                                                   const model::RayScene& rays, const Sensor& sensor,
                                                   const RayGrid& grid, const Context& context);

/// The grid whose returns number about `points` in this scene, told from a coarse one.
[[nodiscard]] RayGrid grid_for(std::size_t points, std::span<const TriangleMesh> meshes_in_world,
                               const model::RayScene& rays, const Sensor& sensor, const NoiseModel& noise,
                               const Context& context);

/// Exact returns with the errors of the noise model. Each ray draws its own numbers from (seed, scan, ray).
[[nodiscard]] RawScan measured(std::span<const RayReturn> returns, const RayGrid& grid, const NoiseModel& noise,
                               std::uint64_t seed, std::uint64_t scan, const Context& context);

/// Area of the surface of all meshes but `excluded` that the rays see, mm^2: each ray stands for the piece it covers.
[[nodiscard]] double seen_area(std::span<const RayReturn> returns, const RayGrid& grid, const NoiseModel& noise,
                               std::uint32_t excluded);

}  // namespace asbuilt::simulate
