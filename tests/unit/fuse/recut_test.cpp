// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/recut.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "asbuilt/core/random.h"

namespace asbuilt::fuse {
namespace {

constexpr double kSigma = 0.02, kSpacing = 0.5, kBoss = 2.0;

// What a point is, in the order in which a scene holds them.
enum class Kind { plate, boss, extra };

struct Scene {
  SeenSegment segment;
  std::vector<Kind> kinds;

  void add(const Eigen::Vector3d& point, Kind kind, bool is_part = true) {
    segment.cloud_in_scan.positions.push_back(point.cast<float>());
    segment.cloud_in_scan.normals.emplace_back(0.0F, 0.0F, 1.0F);
    segment.is_part.push_back(is_part ? 1 : 0);
    kinds.push_back(kind);
  }
};

// A plate of 20 x 20 mm with a square boss in its middle, from above.
Scene scan_of(std::uint64_t index, bool with_boss, bool boss_is_part = true) {
  Scene scene;
  Random random(index, "recut", 0);
  for (double x = 0.0; x < 20.0; x += kSpacing) {
    for (double y = 0.0; y < 20.0; y += kSpacing) {
      const bool boss = with_boss && std::abs(x - 10.0) < 2.0 && std::abs(y - 10.0) < 2.0;
      const double z = (boss ? kBoss : 0.0) + kSigma * random.normal();
      scene.add({x + 0.2 * random.uniform(), y + 0.2 * random.uniform(), z}, boss ? Kind::boss : Kind::plate,
                !boss || boss_is_part);
    }
  }
  scene.segment.noise_sigma_mm = kSigma;
  scene.segment.viewpoint = {scan::Viewpoint::Kind::point, {10.0 + 5.0 * static_cast<double>(index), 10.0, 200.0}};
  return scene;
}

// Extra points of a scan two millimetres above the plate, far from the boss.
void add_extra(Scene& scene, bool is_part) {
  for (double y = 2.0; y < 18.0; y += 1.0) scene.add({3.2, y, 2.0}, Kind::extra, is_part);
}

struct Counts {
  std::size_t all = 0, part = 0;
};
Counts count(const Scene& scene, const std::vector<std::uint8_t>& flags, Kind kind) {
  Counts counts;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    if (scene.kinds[i] != kind) continue;
    ++counts.all;
    counts.part += flags[i];
  }
  return counts;
}

std::vector<std::vector<std::uint8_t>> recut_of(const std::vector<Scene>& scenes, int threads = 2) {
  std::vector<SeenSegment> segments;
  for (const Scene& scene : scenes) segments.push_back(scene.segment);
  return recut(segments, Context(threads)).value();
}

TEST(Recut, WhatAnotherScanSawThroughLeavesThePart) {
  std::vector<Scene> scenes{scan_of(0, true), scan_of(1, true), scan_of(2, true)};
  add_extra(scenes[0], true);
  const auto flags = recut_of(scenes);
  EXPECT_EQ(count(scenes[0], flags[0], Kind::extra).part, 0U);
  for (std::size_t s = 0; s < 3; ++s) {
    for (const Kind kind : {Kind::plate, Kind::boss}) {
      const Counts counts = count(scenes[s], flags[s], kind);
      EXPECT_EQ(counts.part, counts.all) << "scan " << s;
    }
  }
}

TEST(Recut, ParallelRaysSeeThroughAsWell) {
  std::vector<Scene> scenes{scan_of(0, true), scan_of(1, true)};
  for (Scene& scene : scenes) scene.segment.viewpoint = {scan::Viewpoint::Kind::direction, {0.0, 0.0, -1.0}};
  add_extra(scenes[0], true);
  const auto flags = recut_of(scenes);
  EXPECT_EQ(count(scenes[0], flags[0], Kind::extra).part, 0U);
  EXPECT_EQ(count(scenes[1], flags[1], Kind::plate).part, count(scenes[1], flags[1], Kind::plate).all);
}

TEST(Recut, WithoutAViewpointNobodySawThroughAnything) {
  std::vector<Scene> scenes{scan_of(0, true), scan_of(1, true)};
  for (Scene& scene : scenes) scene.segment.viewpoint = {};
  add_extra(scenes[0], true);
  EXPECT_EQ(recut_of(scenes)[0], scenes[0].segment.is_part);
}

TEST(Recut, APlaceThatOnlyOneScanSawStaysAsItIs) {
  std::vector<Scene> scenes{scan_of(0, true), scan_of(1, true)};
  // The second scan has a hole where the first has a boss, wider than that.
  SeenSegment& other = scenes[1].segment;
  SeenSegment holed = other;
  holed.cloud_in_scan = {};
  holed.is_part.clear();
  for (std::size_t i = 0; i < other.is_part.size(); ++i) {
    const Eigen::Vector3f& point = other.cloud_in_scan.positions[i];
    if (std::abs(point.x() - 10.0F) < 5.0F && std::abs(point.y() - 10.0F) < 5.0F) continue;
    holed.cloud_in_scan.positions.push_back(point);
    holed.cloud_in_scan.normals.push_back(other.cloud_in_scan.normals[i]);
    holed.is_part.push_back(1);
  }
  const auto flags = recut(std::vector{scenes[0].segment, holed}, Context(2)).value();
  EXPECT_EQ(flags[0], scenes[0].segment.is_part);
}

TEST(Recut, MarginThatOthersTakeForPartJoinsItAndOtherMarginDoesNot) {
  std::vector<Scene> scenes{scan_of(0, true, false), scan_of(1, true), scan_of(2, true)};
  add_extra(scenes[0], false);
  const auto flags = recut_of(scenes);
  const Counts boss = count(scenes[0], flags[0], Kind::boss);
  EXPECT_EQ(boss.part, boss.all);
  EXPECT_EQ(count(scenes[0], flags[0], Kind::extra).part, 0U);
}

TEST(Recut, IsTheSameForAnyNumberOfThreadsAndAnyOrder) {
  std::vector<Scene> scenes{scan_of(0, true), scan_of(1, true, false), scan_of(2, true)};
  add_extra(scenes[2], true);
  const auto flags = recut_of(scenes, 1);
  EXPECT_EQ(recut_of(scenes, 8), flags);
  std::ranges::reverse(scenes);
  auto reversed = recut_of(scenes, 3);
  std::ranges::reverse(reversed);
  EXPECT_EQ(reversed, flags);
}

TEST(Recut, RefusesFlagsThatAreNotOneAPoint) {
  Scene scene = scan_of(0, false);
  scene.segment.is_part.pop_back();
  EXPECT_EQ(recut(std::vector{scene.segment}, Context(1)).error().code, ErrorCode::invalid_argument);
  EXPECT_TRUE(recut({}, Context(1)).value().empty());
}

}  // namespace
}  // namespace asbuilt::fuse
