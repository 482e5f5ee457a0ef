// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/flying_points.h"

#include <gmock/gmock.h>

#include <array>
#include <numeric>

#include "asbuilt/core/random.h"

namespace asbuilt::verify {
namespace {

constexpr double kSigma = 0.05;  // mm; samples are 1 mm apart
constexpr double kStep = 4.0;    // height of the boss

// A plate that is as the CAD has it (z = 0) with a square boss that it does not have, its walls sampled too, and
// points that fly between the boss's rim and the plate.
struct Scene {
  scan::Scan scan;
  std::vector<float> deviation_mm;
  std::vector<int> kind;  // 0 plate, 1 boss, 2 flying

  void add(const Eigen::Vector3d& point, const Eigen::Vector3f& normal, int of_kind) {
    scan.cloud.positions.push_back(point.cast<float>());
    scan.cloud.normals.push_back(normal);
    deviation_mm.push_back(static_cast<float>(point.z()));
    kind.push_back(of_kind);
  }
};

Scene boss_on_a_plate(bool with_flying) {
  Scene scene;
  Random random(5, "boss", 0);
  const auto noise = [&] { return kSigma * random.normal(); };
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      const bool boss = i >= 25 && i < 35 && j >= 25 && j < 35;
      scene.add({i + 0.5, j + 0.5, (boss ? kStep : 0.0) + noise()}, Eigen::Vector3f::UnitZ(), boss ? 1 : 0);
    }
  }
  for (int k = 0; k < 10; ++k) {
    for (double z = 0.5; z < kStep; z += 1.0) {
      scene.add({25.0 + noise(), 25.5 + k, z}, -Eigen::Vector3f::UnitX(), 1);
      scene.add({35.0 + noise(), 25.5 + k, z}, Eigen::Vector3f::UnitX(), 1);
    }
    if (with_flying) {
      scene.add({25.5 + k, 24.8, random.uniform(0.15, 0.85) * kStep}, Eigen::Vector3f::UnitZ(), 2);
      scene.add({25.5 + k, 35.2, random.uniform(0.15, 0.85) * kStep}, Eigen::Vector3f::UnitZ(), 2);
    }
  }
  scene.scan.noise_sigma_mm = kSigma;
  scene.scan.spacing_mm = 1.0;
  return scene;
}

std::vector<std::uint8_t> flying_in(const Scene& scene, const Context& context = Context(2)) {
  std::vector<std::uint32_t> all(scene.scan.cloud.size());
  std::iota(all.begin(), all.end(), 0U);
  return flying_points(all, scene.deviation_mm, scene.scan, context);
}

TEST(FlyingPoints, AreFoundBesideABossThatStays) {
  const Scene scene = boss_on_a_plate(true);
  const std::vector<std::uint8_t> flying = flying_in(scene);
  std::array<double, 3> count{}, flagged{};
  for (std::size_t i = 0; i < flying.size(); ++i) {
    ++count[static_cast<std::size_t>(scene.kind[i])];
    flagged[static_cast<std::size_t>(scene.kind[i])] += flying[i];
  }
  EXPECT_EQ(flagged[0], 0.0);
  EXPECT_LT(flagged[1] / count[1], 0.05);
  EXPECT_GT(flagged[2] / count[2], 0.7);
}

// The foot and the corners of a wall are the hardest: half of the neighbours are of other faces.
TEST(FlyingPoints, AreHardlyAnyWhereNoneFly) {
  const std::vector<std::uint8_t> flying = flying_in(boss_on_a_plate(false));
  EXPECT_LE(std::accumulate(flying.begin(), flying.end(), 0), 4);  // of 180 on the boss
}

TEST(FlyingPoints, AreTheSameForAnyNumberOfThreads) {
  const Scene scene = boss_on_a_plate(true);
  EXPECT_EQ(flying_in(scene, Context(1)), flying_in(scene, Context(3)));
}

TEST(FlyingPoints, AreNotSoughtAmongAHandful) {
  Scene scene;
  for (int i = 0; i < 5; ++i) scene.add({i * 1.0, 0, i * 2.0}, Eigen::Vector3f::UnitZ(), 0);
  EXPECT_THAT(flying_in(scene), testing::Each(0));
}

}  // namespace
}  // namespace asbuilt::verify
