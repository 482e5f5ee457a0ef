// SPDX-License-Identifier: Apache-2.0
// Outer skins of real CAD parts against brute force: from each of many even spots on the surface, is one of 400
// places around the part in sight?
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <vector>

#include "asbuilt/core/parallel.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt {
namespace {

namespace fs = std::filesystem;

const fs::path kCad = fs::path(ASBUILT_DATA_DIR) / "cad";
constexpr int kViewpoints = 400;

/// Evenly spread over a sphere of three diameters around the middle of the part (Fibonacci's lattice).
std::vector<Eigen::Vector3d> viewpoints_around(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> viewpoints;
  const Eigen::Vector3d centre = bounding_box(mesh).center();
  for (int i = 0; i < kViewpoints; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kViewpoints, angle = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    viewpoints.push_back(centre + 3.0 * diameter(mesh) * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z));
  }
  return viewpoints;
}

/// For each spot, whether any viewpoint sees it.
std::vector<std::uint8_t> seen(const PointCloud& spots, const TriangleMesh& mesh, const Context& context) {
  const model::RayScene rays(mesh);
  const std::vector<Eigen::Vector3d> viewpoints = viewpoints_around(mesh);
  const double lift = 1e-5 * diameter(mesh);
  std::vector<std::uint8_t> result(spots.size(), 0);
  parallel_for(context, spots.size(), 64, [&](std::size_t i) {
    const Eigen::Vector3d spot = spots.positions[i].cast<double>(), normal = spots.normals[i].cast<double>();
    for (std::size_t v = 0; v < viewpoints.size() && result[i] == 0; ++v) {
      const Eigen::Vector3d direction = (viewpoints[v] - spot).normalized();
      // Either side of a face may be the one that is seen; grazing rays say nothing about it.
      const double cosine = direction.dot(normal);
      if (std::abs(cosine) < 0.02) continue;
      const Eigen::Vector3d origin = spot + (cosine > 0.0 ? lift : -lift) * normal;
      if (!rays.is_blocked(origin, direction, 0.0, 4.0 * diameter(mesh))) result[i] = 1;
    }
  });
  return result;
}

double share(const std::vector<std::uint8_t>& flags, std::uint8_t wanted) {
  std::size_t count = 0;
  for (const std::uint8_t flag : flags) count += flag == wanted ? 1 : 0;
  return static_cast<double>(count) / static_cast<double>(flags.size());
}

struct Figures {
  double hidden_before, hidden_after, visible_lost;
};

Figures figures_of(const char* file) {
  const Context context;
  const TriangleMesh whole = io::read_mesh(kCad / file, io::Unit::stated).value();
  const model::PreparedModel model = model::prepare(whole, {}, context).value();
  // Some 4000 spots, each standing for the same area.
  const double spacing = std::sqrt(surface_area(whole) / 4000.0);
  const PointCloud before = model::even_samples(whole, spacing, 7, context);
  const PointCloud after = model::even_samples(model.skin, spacing, 7, context);
  const std::vector<std::uint8_t> seen_before = seen(before, whole, context);
  std::size_t visible = 0, lost = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (seen_before[i] == 0) continue;
    ++visible;
    const double distance = std::abs(model.surface->nearest(before.positions[i].cast<double>()).signed_distance);
    lost += distance > 1e-4 * model.diameter ? 1 : 0;
  }
  // Against the whole part: what inner faces hide is hidden all the same.
  return {share(seen_before, 0), share(seen(after, whole, context), 0),
          static_cast<double>(lost) / static_cast<double>(visible)};
}

class OuterSkinOf : public testing::TestWithParam<const char*> {};

TEST_P(OuterSkinOf, LosesNothingThatABruteForceSearchSees) {
  if (!fs::exists(kCad)) GTEST_SKIP() << kCad << " is not there";
  const Figures figures = figures_of(GetParam());
  RecordProperty("hidden_before", std::to_string(figures.hidden_before));
  std::printf("%s: hidden %.2f %% before, %.2f %% after, %.3f %% of the visible area lost\n", GetParam(),
              100 * figures.hidden_before, 100 * figures.hidden_after, 100 * figures.visible_lost);
  EXPECT_LE(figures.visible_lost, 0.005);
  EXPECT_LE(figures.hidden_after, figures.hidden_before + 0.01);
}

INSTANTIATE_TEST_SUITE_P(Cad, OuterSkinOf, testing::Values("motor_assembly.stl", "frame.stl", "linkrod.stl"));

TEST(OuterSkinOfTheMotor, HasNoInnerPartsAnyMore) {
  if (!fs::exists(kCad)) GTEST_SKIP() << kCad << " is not there";
  const Figures figures = figures_of("motor_assembly.stl");
  EXPECT_GT(figures.hidden_before, 0.2);
  // What stays hidden are walls of bores and gaps, which close the skin.
  EXPECT_LT(figures.hidden_after, 0.25 * figures.hidden_before);
}

}  // namespace
}  // namespace asbuilt
