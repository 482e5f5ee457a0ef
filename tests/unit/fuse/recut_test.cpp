// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/recut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

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
  const std::vector<RecutSegment> cut = recut(segments, Context(threads)).value();
  std::vector<std::vector<std::uint8_t>> flags;
  for (const RecutSegment& segment : cut) flags.push_back(segment.is_part);
  return flags;
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
  const auto cut = recut(std::vector{scenes[0].segment, holed}, Context(2)).value();
  EXPECT_EQ(cut[0].is_part, scenes[0].segment.is_part);
}

TEST(Recut, MarginThatOthersTakeForPartJoinsItAndOtherMarginDoesNot) {
  std::vector<Scene> scenes{scan_of(0, true, false), scan_of(1, true), scan_of(2, true)};
  add_extra(scenes[0], false);
  const auto flags = recut_of(scenes);
  const Counts boss = count(scenes[0], flags[0], Kind::boss);
  EXPECT_EQ(boss.part, boss.all);
  EXPECT_EQ(count(scenes[0], flags[0], Kind::extra).part, 0U);
}

// A bar in mid-air, scanned from all sides. Where a beam meets its outline, what is measured lies up to 4 mm behind it.
struct Bar {
  const Eigen::Vector3d half{30.0, 5.0, 5.0};
  static constexpr double kNoise = 0.1;

  // Range and outward normal of what a ray meets first; nullopt if it passes.
  [[nodiscard]] std::optional<std::pair<double, Eigen::Vector3d>> hit(const Eigen::Vector3d& from,
                                                                      const Eigen::Vector3d& along) const {
    double enters = 0.0, leaves = 1e9;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double sign = along[axis] > 0.0 ? 1.0 : -1.0;
      const double near = (-sign * half[axis] - from[axis]) / along[axis];
      leaves = std::min(leaves, (sign * half[axis] - from[axis]) / along[axis]);
      if (near <= enters) continue;
      enters = near;
      normal = -sign * Eigen::Vector3d::Unit(axis);
    }
    if (enters <= 0.0 || enters >= leaves) return std::nullopt;
    return std::pair(enters, normal);
  }

  [[nodiscard]] double distance(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d beyond = point.cwiseAbs() - half;
    return std::abs(beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0));
  }

  // To the nearest of the twelve edges, for points near the surface.
  [[nodiscard]] double distance_to_edges(const Eigen::Vector3d& point) const {
    Eigen::Array3d off = (point.cwiseAbs() - half).array().abs();
    std::ranges::sort(off);
    return std::hypot(off[0], off[1]);
  }

  [[nodiscard]] SeenSegment scan_from(const Eigen::Vector3d& sensor, std::uint64_t seed) const {
    constexpr double kStep = 0.003, kBeam = 0.0015;  // radians, between rays and across half a beam
    Random random(seed, "bar", 0);
    const Eigen::Vector3d forward = -sensor.normalized();
    const Eigen::Vector3d right = forward.unitOrthogonal(), up = right.cross(forward);
    const auto ray = [&](double x, double y) { return (forward + x * right + y * up).normalized(); };
    SeenSegment segment;
    for (int row = -40; row <= 40; ++row) {
      for (int column = -40; column <= 40; ++column) {
        const double x = kStep * column, y = kStep * row;
        const auto met = hit(sensor, ray(x, y));
        if (!met) continue;
        const bool mixed = !hit(sensor, ray(x + kBeam, y)) || !hit(sensor, ray(x - kBeam, y)) ||
                           !hit(sensor, ray(x, y + kBeam)) || !hit(sensor, ray(x, y - kBeam));
        const double range = met->first + (mixed ? 4.0 * random.uniform() : 0.0) + kNoise * random.normal();
        segment.cloud_in_scan.positions.push_back((sensor + range * ray(x, y)).cast<float>());
        segment.cloud_in_scan.normals.push_back(met->second.cast<float>());
      }
    }
    segment.is_part.assign(segment.cloud_in_scan.size(), 1);
    segment.noise_sigma_mm = kNoise;
    segment.viewpoint = {scan::Viewpoint::Kind::point, sensor};
    return segment;
  }
};

// Near an edge the planes of others pass by a point that hangs behind the outline, and of three rays of a scan next to
// it one often meets the bar: neither may keep the point.
TEST(Recut, PointsBehindAnOutlineLeaveThePartAndEdgesStay) {
  const Bar bar;
  std::size_t far = 0, far_left = 0, near = 0, near_part = 0, near_left = 0, at_edges = 0, at_edges_left = 0;
  for (std::uint64_t scene = 0; scene < 4; ++scene) {
    std::vector<SeenSegment> segments;
    for (std::uint64_t s = 0; s < 8; ++s) {
      const double turn = 0.4 + 0.785 * static_cast<double>(s), rise = s % 2 == 0 ? 0.5 : -0.6;
      const Eigen::Vector3d direction = Eigen::Vector3d(std::cos(turn), std::sin(turn), rise).normalized();
      segments.push_back(bar.scan_from(400.0 * direction, 8 * scene + s));
    }
    const std::vector<RecutSegment> cut = recut(segments, Context(2)).value();
    for (std::size_t s = 0; s < segments.size(); ++s) {
      for (std::size_t i = 0; i < cut[s].is_part.size(); ++i) {
        const std::uint8_t is_left = cut[s].is_part[i] != 0 && cut[s].in_doubt[i] == 0 ? 1 : 0;
        const Eigen::Vector3d point = segments[s].cloud_in_scan.positions[i].cast<double>();
        const bool is_far = bar.distance(point) > 6.0 * Bar::kNoise;
        const bool is_at_edge = !is_far && bar.distance_to_edges(point) < 0.5;
        far += is_far ? 1 : 0;
        far_left += is_far ? is_left : 0;
        near += is_far ? 0 : 1;
        near_part += is_far ? 0 : cut[s].is_part[i];
        near_left += is_far ? 0 : is_left;
        at_edges += is_at_edge ? 1 : 0;
        at_edges_left += is_at_edge ? is_left : 0;
      }
    }
  }
  ASSERT_GT(far, 500U);
  ASSERT_GT(at_edges, 500U);
  // One of fifty. Confirmed by two planes, whatever their share, 64 of 848 stayed.
  EXPECT_LE(50 * far_left, far);
  EXPECT_GE(static_cast<double>(near_part), 0.98 * static_cast<double>(near));
  EXPECT_GE(static_cast<double>(near_left), 0.96 * static_cast<double>(near));
  EXPECT_GE(static_cast<double>(at_edges_left), 0.92 * static_cast<double>(at_edges));
}

// Nobody else measured the far end of the bar: all that flies there stays, as a wire would.
TEST(Recut, WhatOneScanAloneMeasuredIsNotInDoubt) {
  const Bar bar;
  std::vector<SeenSegment> segments{bar.scan_from({250.0, 200.0, 250.0}, 1), bar.scan_from({-250.0, 200.0, 250.0}, 2)};
  SeenSegment& other = segments[1];
  SeenSegment cut = other;
  cut.cloud_in_scan = {};
  for (std::size_t i = 0; i < other.is_part.size(); ++i) {
    const Eigen::Vector3f& point = other.cloud_in_scan.positions[i];
    if (point.x() > 5.0F) continue;
    cut.cloud_in_scan.positions.push_back(point);
    cut.cloud_in_scan.normals.push_back(other.cloud_in_scan.normals[i]);
  }
  cut.is_part.assign(cut.cloud_in_scan.size(), 1);
  segments[1] = cut;
  const std::vector<RecutSegment> result = recut(segments, Context(2)).value();
  std::size_t alone = 0, stays = 0;
  for (std::size_t i = 0; i < result[0].is_part.size(); ++i) {
    if (segments[0].cloud_in_scan.positions[i].x() < 10.0F) continue;
    ++alone;
    stays += result[0].is_part[i] != 0 && result[0].in_doubt[i] == 0 ? 1 : 0;
  }
  EXPECT_GT(alone, 100U);
  EXPECT_EQ(stays, alone);
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
