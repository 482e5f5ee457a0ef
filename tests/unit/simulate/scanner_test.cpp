// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/scanner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/parts.h"
#include "asbuilt/simulate/visibility.h"

namespace asbuilt::simulate {
namespace {

constexpr double kPi = std::numbers::pi;

TriangleMesh placed(const TriangleMesh& mesh, const Eigen::Vector3d& where, double turn_about_y = 0.0) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::AngleAxisd(turn_about_y, Eigen::Vector3d::UnitY()).toRotationMatrix();
  pose.translation() = where;
  return transformed(mesh, pose);
}

NoiseModel clean() {
  NoiseModel noise;
  noise.fading_deg = 88.0;
  noise.grazing_deg = 89.0;
  return noise;
}

struct Shot {
  RayGrid grid;
  std::vector<RayReturn> returns;
  RawScan raw;
};

Shot shoot(const std::vector<TriangleMesh>& meshes, const Sensor& sensor, const NoiseModel& noise, double step) {
  const Context context(2);
  const model::RayScene rays(meshes);
  const RayGrid grid(sensor, step);
  auto returns = exact_returns(meshes, rays, sensor, grid, context);
  RawScan raw = measured(returns, grid, noise, 7, 0, context);
  return {grid, std::move(returns), std::move(raw)};
}

TEST(Scanner, PointsOfASphereLieOnIt) {
  const Eigen::Vector3d centre(10, -20, 1000);
  const Shot shot = shoot({placed(sphere(100, 7), centre)}, Sensor{}, clean(), 0.005);
  ASSERT_GT(shot.raw.points_in_scan.size(), 500U);
  // The polyhedron lies up to r (1 - cos(edge / 2r)) within the sphere: 0.01 mm at 7 levels.
  for (const Eigen::Vector3f& p : shot.raw.points_in_scan) EXPECT_NEAR((p.cast<double>() - centre).norm(), 100.0, 0.02);
}

TEST(Scanner, NoiseOfAPlaneIsThatOfTheModel) {
  for (const double tilt_deg : {0.0, 60.0}) {
    NoiseModel noise = clean();
    noise.sigma_mm = 0.5;
    noise.reference_mm = 500.0;
    noise.lateral_share = 0.0;
    Sensor sensor;
    sensor.half_width = 0.1;  // so narrow that range and incidence hardly vary
    const auto meshes = std::vector{placed(box({2000, 2000, 1}), {0, 0, 1000}, tilt_deg / 180.0 * kPi)};
    const Shot shot = shoot(meshes, sensor, noise, 0.001);
    double squares = 0.0, expected = 0.0;
    std::size_t count = 0;
    ASSERT_EQ(shot.raw.points_in_scan.size(), shot.returns.size());  // nothing is lost here
    for (std::size_t i = 0; i < shot.returns.size(); ++i) {
      const double error = shot.raw.points_in_scan[i].cast<double>().norm() - shot.returns[i].range_mm;
      const double range = shot.returns[i].range_mm, slant = 1.0 / shot.returns[i].cos_incidence;
      squares += error * error;
      expected += std::pow(0.5 * std::pow(range / 500.0, 2) * (1.0 + 0.3 * (slant - 1.0)), 2);
      ++count;
    }
    ASSERT_GT(count, 20000U);
    EXPECT_NEAR(std::sqrt(squares / expected), 1.0, 0.02) << tilt_deg;  // 4 standard errors of 30 000 points
  }
}

TEST(Scanner, LateralNoiseMovesPointsAcrossTheRayOnly) {
  NoiseModel noise = clean();
  noise.sigma_mm = 1.0;
  noise.lateral_share = 0.5;
  Sensor sensor;
  sensor.half_width = 0.05;
  const Shot shot = shoot({placed(box({2000, 2000, 1}), {0, 0, 1000.5})}, sensor, noise, 0.0005);
  double x2 = 0.0, z2 = 0.0;
  for (std::size_t i = 0; i < shot.returns.size(); ++i) {
    const Eigen::Vector3d exact = shot.returns[i].range_mm * shot.grid.direction_in_scan(i);
    const Eigen::Vector3d error = shot.raw.points_in_scan[i].cast<double>() - exact;
    x2 += error.x() * error.x();
    z2 += error.z() * error.z();
  }
  EXPECT_NEAR(std::sqrt(x2 / static_cast<double>(shot.returns.size())), 0.5, 0.02);
  EXPECT_NEAR(std::sqrt(z2 / static_cast<double>(shot.returns.size())), 1.0, 0.03);
}

TEST(Scanner, RangesAreRoundedToTheQuantum) {
  NoiseModel noise = clean();
  noise.sigma_mm = 0.3;
  noise.lateral_share = 0.0;
  noise.quantum_mm = 0.5;
  const Shot shot = shoot({placed(box({2000, 2000, 1}), {0, 0, 1000})}, Sensor{}, noise, 0.01);
  for (const Eigen::Vector3f& p : shot.raw.points_in_scan) {
    const double steps = p.cast<double>().norm() / 0.5;
    EXPECT_NEAR(steps, std::round(steps), 1e-3);
  }
}

TEST(Scanner, DropoutsTakeTheirShareAndGrazingSurfacesVanish) {
  NoiseModel noise;
  noise.dropout_share = 0.2;
  Sensor sensor;
  sensor.half_width = 0.1;
  const auto plate = box({2000, 2000, 1});
  const Shot straight = shoot({placed(plate, {0, 0, 1000})}, sensor, noise, 0.001);
  const auto share =
      static_cast<double>(straight.raw.points_in_scan.size()) / static_cast<double>(straight.returns.size());
  EXPECT_NEAR(share, 0.8, 0.01);
  sensor.half_width = 0.005;
  const Shot grazing = shoot({placed(plate, {0, 0, 1000}, 87.0 / 180.0 * kPi)}, sensor, noise, 0.0005);
  ASSERT_NE(grazing.returns.front().mesh, RayReturn::kNothing);
  EXPECT_TRUE(grazing.raw.points_in_scan.empty());
}

TEST(Scanner, FlyingPointsLieBetweenTheSurfacesAtDepthEdgesOnly) {
  NoiseModel noise = clean();
  noise.flying_share = 1.0;
  const Shot shot = shoot({placed(box({4000, 4000, 1}), {0, 0, 1300}), placed(box({300, 300, 1}), {0, 0, 1000})},
                          Sensor{}, noise, 0.004);
  std::size_t flying = 0;
  for (std::size_t i = 0; i < shot.raw.points_in_scan.size(); ++i) {
    if (shot.raw.mesh_of_point[i] != RawScan::kFlying) continue;
    ++flying;
    const Eigen::Vector3d p = shot.raw.points_in_scan[i].cast<double>();
    EXPECT_GT(p.z(), 1010.0);
    EXPECT_LT(p.z(), 1290.0);
    EXPECT_NEAR((p / p.z()).head<2>().cwiseAbs().maxCoeff(), 0.15, 0.005);  // the outline of the front plate
  }
  EXPECT_GT(flying, 100U);
  EXPECT_LT(flying, 400U);  // an outline of 4 x 75 rays
}

TEST(Scanner, AFloorSeenAtAFlatAngleHasNoFlyingPoints) {
  NoiseModel noise = clean();
  noise.flying_share = 1.0;
  Sensor sensor;
  sensor.kind = SensorKind::laser_scanner;
  const Shot shot = shoot({placed(box({10000, 10000, 1}), {0, 0, -500})}, sensor, noise, 0.02);
  EXPECT_GT(shot.raw.points_in_scan.size(), 5000U);
  EXPECT_EQ(std::ranges::count(shot.raw.mesh_of_point, RawScan::kFlying), 0);
}

TEST(Scanner, SolidAnglesAddUpToTheField) {
  Sensor sensor;
  const auto sum = [](const RayGrid& grid) {
    double total = 0.0;
    for (std::size_t i = 0; i < grid.size(); ++i) total += grid.solid_angle(i);
    return total;
  };
  // A pyramid with half tangents a and b: 4 asin(a b / sqrt((1 + a^2)(1 + b^2))).
  const double a = 0.4, b = 0.3;
  sensor.half_width = a;
  EXPECT_NEAR(sum(RayGrid(sensor, 0.001)), 4.0 * std::asin(a * b / std::sqrt((1 + a * a) * (1 + b * b))), 1e-4);
  sensor.kind = SensorKind::laser_scanner;
  EXPECT_NEAR(sum(RayGrid(sensor, 0.002)), 2.0 * kPi * (1.0 + std::sin(kPi / 3.0)), 0.02);
}

TEST(Scanner, SeenAreaIsThatOfTheSurface) {
  const std::vector<TriangleMesh> meshes{placed(box({300, 200, 1}), {0, 0, 1000}, 0.7),
                                         placed(sphere(20, 3), {0, 0, 500})};
  const Shot shot = shoot({meshes.front()}, Sensor{}, clean(), 0.002);
  EXPECT_NEAR(seen_area(shot.returns, shot.grid, clean(), 5), 300.0 * 200.0, 0.02 * 60000.0);
  EXPECT_EQ(seen_area(shot.returns, shot.grid, clean(), 0), 0.0);
}

TEST(Scanner, TheGridGivesAboutAsManyPointsAsAskedFor) {
  const Context context(2);
  Sensor sensor;
  const std::vector<TriangleMesh> meshes{placed(sphere(150, 5), {100, 0, 1000})};
  const model::RayScene rays(meshes);
  NoiseModel noise;
  noise.dropout_share = 0.1;
  const RayGrid grid = grid_for(20000, meshes, rays, sensor, noise, context);
  const RawScan raw = measured(exact_returns(meshes, rays, sensor, grid, context), grid, noise, 1, 0, context);
  EXPECT_NEAR(static_cast<double>(raw.points_in_scan.size()), 20000.0, 1000.0);
}

TEST(Scanner, RangeLimitsCutOff) {
  Sensor sensor;
  sensor.near_mm = 900.0;
  sensor.far_mm = 1100.0;
  const Shot shot = shoot({placed(box({50, 50, 1}), {100, 0, 800}), placed(box({50, 50, 1}), {-100, 0, 1000}),
                           placed(box({50, 50, 1}), {0, 150, 1200})},
                          sensor, clean(), 0.005);
  ASSERT_FALSE(shot.raw.mesh_of_point.empty());
  for (const std::uint32_t mesh : shot.raw.mesh_of_point) EXPECT_EQ(mesh, 1U);
}

TEST(Visibility, OfASphereFromOutsideIsThePartAboveTheHorizon) {
  const TriangleMesh ball = placed(sphere(100, 6), {0, 0, 400});
  const auto samples = area_samples(ball, 20000, Random(1, "ball", 0));
  const auto visible = visible_samples(samples, model::RayScene(ball), Sensor{});
  // The cap that a point at distance d sees of a sphere has the share (1 - r / d) / 2.
  EXPECT_NEAR(static_cast<double>(visible.size()) / 20000.0, 0.5 * (1.0 - 100.0 / 400.0), 0.01);
}

TEST(Visibility, APlateBeforeTheSensorCoversWhatLiesInItsShadow) {
  const TriangleMesh wall = placed(box({400, 200, 1}), {0, 0, 1000});
  const TriangleMesh plate = placed(box({50, 400, 1}), {25, 0, 500});  // covers x in [0, 100] of the wall
  const auto samples = area_samples(wall, 20000, Random(1, "wall", 0));
  const auto visible = visible_samples(samples, model::RayScene(wall), Sensor{});
  const auto covered = covered_samples(samples, visible, model::RayScene(plate), Sensor{});
  EXPECT_NEAR(static_cast<double>(covered.size()) / static_cast<double>(visible.size()), 0.25, 0.01);
}

}  // namespace
}  // namespace asbuilt::simulate
