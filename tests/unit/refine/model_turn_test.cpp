// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/model_turn.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/random.h"

namespace asbuilt::refine {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kPartRadius = 50.0, kHeight = 40.0, kPartDiameter = 110.0, kSigma = 0.1;  // mm
constexpr int kRibs = 10;
constexpr double kPeriod = 2.0 * kPi / kRibs;

// Ten ribs, 2.5 mm wide, around a drum.
double rib(double angle, double height) {
  const double from_middle = std::remainder(angle, kPeriod) * kPartRadius;
  return height * std::clamp(2.0 - std::abs(from_middle), 0.0, 1.0);
}

TriangleMesh drum(double rib_height) {
  TriangleMesh mesh;
  constexpr int kSides = 1200;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * kPi * i / kSides, radius = kPartRadius + rib(angle, rib_height);
    for (const double z : {0.0, kHeight})
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  for (int i = 0; i < kSides; ++i) {
    const int a = 2 * i, b = 2 * ((i + 1) % kSides);
    mesh.triangles.emplace_back(a, b, b + 1);
    mesh.triangles.emplace_back(a, b + 1, a + 1);
  }
  return mesh;
}

// What a sensor on the x axis sees of the drum: it is warped by three sigma, as parts are.
View view_of(double rib_height, std::uint64_t seed) {
  View view;
  view.noise_sigma_mm = kSigma;
  Random random(seed, "drum", 0);
  for (int i = 0; i < 12000; ++i) {
    const double angle = random.uniform(-1.2, 1.2);
    const double warp = 3.0 * kSigma * std::cos(2.0 * angle + static_cast<double>(seed));
    const double radius = kPartRadius + rib(angle, rib_height) + warp + kSigma * random.normal();
    const Eigen::Vector3d outwards(std::cos(angle), std::sin(angle), 0.0);
    view.segment_in_scan.positions.push_back(
        (radius * outwards + random.uniform(0.0, kHeight) * Eigen::Vector3d::UnitZ()).cast<float>());
    view.segment_in_scan.normals.push_back(outwards.cast<float>());
  }
  return view;
}

const TurnAxis kAxis{Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero(), kPeriod};

TEST(TurnOnModel, LowRibsTellIt) {
  const TriangleMesh mesh = drum(0.55);  // half a per cent of the diameter
  const model::SurfaceDistance surface(mesh);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    View view = view_of(0.55, seed);
    const double off = 0.09 * static_cast<double>(seed) + 0.02;  // seed 3: nearly half-way between two ribs
    view.model_from_scan = Pose(Eigen::AngleAxisd(off, Eigen::Vector3d::UnitZ()));
    const ModelTurn turn = turn_on_model(view, surface, kPartDiameter, kAxis, Context(2)).value();
    EXPECT_TRUE(turn.is_told) << "seed " << seed;
    EXPECT_LT(std::abs(std::remainder(off + turn.angle_rad, kPeriod)) * kPartRadius, 0.003 * kPartDiameter)
        << "seed " << seed;
  }
}

TEST(TurnOnModel, NothingTellsTheTurnsOfARoundPartApart) {
  const TriangleMesh mesh = drum(0.0);
  const model::SurfaceDistance surface(mesh);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    EXPECT_FALSE(turn_on_model(view_of(0.0, seed), surface, kPartDiameter, kAxis, Context(2)).value().is_told);
  }
}

TEST(TurnOnModel, RibsThatNoiseHidesTellNothingWrong) {
  const TriangleMesh mesh = drum(0.05);  // half a sigma high
  const model::SurfaceDistance surface(mesh);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    View view = view_of(0.05, seed);
    view.model_from_scan = Pose(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()));
    const ModelTurn turn = turn_on_model(view, surface, kPartDiameter, kAxis, Context(2)).value();
    const double off_mm = std::abs(std::remainder(0.3 + turn.angle_rad, kPeriod)) * kPartRadius;
    EXPECT_TRUE(!turn.is_told || off_mm < 0.01 * kPartDiameter) << "seed " << seed;
  }
}

TEST(TurnOnModel, IsTheSameForAnyNumberOfThreadsAndRefusesWhatIsNone) {
  const TriangleMesh mesh = drum(0.55);
  const model::SurfaceDistance surface(mesh);
  View view = view_of(0.55, 1);
  const ModelTurn one = turn_on_model(view, surface, kPartDiameter, kAxis, Context(1)).value();
  const ModelTurn eight = turn_on_model(view, surface, kPartDiameter, kAxis, Context(8)).value();
  EXPECT_EQ(one.angle_rad, eight.angle_rad);
  EXPECT_EQ(one.is_told, eight.is_told);
  EXPECT_FALSE(turn_on_model(View{}, surface, kPartDiameter, kAxis, Context(1)).value().is_told);
  EXPECT_FALSE(turn_on_model(view, surface, 0.0, kAxis, Context(1)));
  EXPECT_FALSE(turn_on_model(view, surface, kPartDiameter, TurnAxis{}, Context(1)));
  view.segment_in_scan.normals.pop_back();
  EXPECT_EQ(turn_on_model(view, surface, kPartDiameter, kAxis, Context(1)).error().code, ErrorCode::invalid_argument);
}

}  // namespace
}  // namespace asbuilt::refine
