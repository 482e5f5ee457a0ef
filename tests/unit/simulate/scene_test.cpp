// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/simulate/scene.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

// Moeller and Trumbore, over all triangles: an oracle that shares nothing with the ray scene.
bool is_cut(const TriangleMesh& mesh, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d way = to - from;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    const Eigen::Vector3d first = at(1) - at(0), second = at(2) - at(0), h = way.cross(second);
    const double determinant = first.dot(h);
    if (determinant == 0.0) continue;
    const Eigen::Vector3d s = (from - at(0)) / determinant;
    const double u = s.dot(h);
    if (u < 0.0 || u > 1.0) continue;
    const Eigen::Vector3d q = s.cross(first);
    const double v = way.dot(q), distance = second.dot(q);
    if (v >= 0.0 && u + v <= 1.0 && distance > 0.0 && distance < 1.0 - 1e-4) return true;
  }
  return false;
}

bool is_seen(const SurfacePoint& sample, const Sensor& sensor, std::span<const TriangleMesh> meshes) {
  const Eigen::Vector3d eye = sensor.position_in_world();
  if (sample.normal.dot(eye - sample.position) <= 0.0 || !sensor.has_in_view(sample.position)) return false;
  return std::ranges::none_of(meshes, [&](const TriangleMesh& mesh) { return is_cut(mesh, eye, sample.position); });
}

SimulateOptions small_scene() {
  SimulateOptions options;
  options.clutter_objects = 4;
  options.hidden_low = 0.2;
  options.hidden_high = 0.4;
  options.clutter_high = 0.95;
  return options;
}

TEST(Scene, OcclusionHiddenAndClutterAreWhatBruteForceFinds) {
  const TriangleMesh part = test::stepped_block();
  const SimulateOptions options = small_scene();
  const NoiseModel noise = noise_model(options, diameter(part));
  const Scene scene = arrange(part, options, noise, 0, true, Context(2));
  const std::span<const TriangleMesh> all(scene.meshes_in_world);
  const std::span<const TriangleMesh> part_only = all.subspan(Scene::kPart, 1);

  const auto samples = area_samples(all[Scene::kPart], 3000, Random(11, "oracle", 0));
  double seen = 0.0, unobstructed = 0.0;
  for (const SurfacePoint& sample : samples) {
    seen += is_seen(sample, scene.sensor, all);
    unobstructed += is_seen(sample, scene.sensor, part_only);
  }
  EXPECT_NEAR(scene.occlusion, 1.0 - seen / 3000.0, 0.03);  // 4 standard errors of 3000 draws
  EXPECT_NEAR(scene.hidden, 1.0 - seen / unobstructed, 0.03);

  // The area of the rest: draws over the other things and over the near part of the floor.
  const double near = 3.0 * diameter(part);
  double other_mm2 = 0.0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i == Scene::kPart) continue;
    const TriangleMesh floor = box({2.0 * near, 2.0 * near, 1e-3});
    const TriangleMesh& mesh = i == Scene::kSurroundings ? floor : all[i];
    const std::size_t draws = i == Scene::kSurroundings ? 12000 : 1500;
    double count = 0.0;
    for (SurfacePoint sample : area_samples(mesh, draws, Random(12, "oracle", i))) {
      const Eigen::Vector3d way = (scene.sensor.position_in_world() - sample.position).normalized();
      if (sample.normal.dot(way) < std::cos(noise.grazing_deg / 180.0 * 3.14159265358979)) continue;
      count += is_seen(sample, scene.sensor, all);
    }
    other_mm2 += count / static_cast<double>(draws) * surface_area(mesh);
  }
  const double visible_mm2 = seen / 3000.0 * surface_area(part);
  EXPECT_NEAR(scene.clutter, 1.0 - visible_mm2 / (visible_mm2 + other_mm2), 0.02);
}

TEST(Scene, RangesOfHiddenShareAndClutterAreMet) {
  const TriangleMesh part = test::casing();
  SimulateOptions options = small_scene();
  options.clutter_low = 0.7;
  options.clutter_high = 0.9;
  const NoiseModel noise = noise_model(options, diameter(part));
  for (std::uint64_t i = 0; i < 3; ++i) {
    const Scene scene = arrange(part, options, noise, i, true, Context(2));
    EXPECT_GE(scene.hidden, options.hidden_low);
    EXPECT_LE(scene.hidden, options.hidden_high);
    EXPECT_GE(scene.clutter, options.clutter_low);
    EXPECT_LE(scene.clutter, options.clutter_high);
  }
}

TEST(Scene, ThingsStandOnTheFloorAndThePartWhereItsPoseSays) {
  const TriangleMesh part = test::stepped_block();
  const SimulateOptions options = small_scene();
  const Scene scene = arrange(part, options, noise_model(options, diameter(part)), 1, true, Context(1));
  ASSERT_GT(scene.meshes_in_world.size(), 3U);
  for (std::size_t i = Scene::kPart; i < scene.meshes_in_world.size(); ++i) {
    EXPECT_NEAR(bounding_box(scene.meshes_in_world[i]).min().z(), 0.0, 1e-6) << "thing " << i;
  }
  EXPECT_EQ(scene.meshes_in_world[Scene::kPart].vertices, transformed(part, *scene.world_from_model).vertices);
}

TEST(Scene, WithoutThePartNothingOfItIsThere) {
  const TriangleMesh part = test::stepped_block();
  const SimulateOptions options = small_scene();
  const Scene scene = arrange(part, options, noise_model(options, diameter(part)), 0, false, Context(1));
  EXPECT_TRUE(scene.meshes_in_world[Scene::kPart].empty());
  EXPECT_FALSE(scene.world_from_model.has_value());
  EXPECT_EQ(scene.occlusion, 1.0);
  EXPECT_EQ(scene.hidden, 1.0);
  EXPECT_EQ(scene.clutter, 1.0);
}

}  // namespace
}  // namespace asbuilt::simulate
