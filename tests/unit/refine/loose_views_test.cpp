// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/loose_views.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/core/random.h"
#include "asbuilt/refine/suspicious_view.h"

namespace asbuilt::refine {
namespace {

// A block, 120 x 80 x 60 mm about the origin.
TriangleMesh block() {
  TriangleMesh mesh;
  for (const double z : {-30.0, 30.0}) {
    for (const double y : {-40.0, 40.0}) {
      for (const double x : {-60.0, 60.0}) mesh.vertices.emplace_back(x, y, z);
    }
  }
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& side : kSides) {
    mesh.triangles.emplace_back(side[0], side[1], side[2]);
    mesh.triangles.emplace_back(side[0], side[2], side[3]);
  }
  return mesh;
}

constexpr double kViewNoise = 0.05;

// Samples 1.5 mm apart of the sides that look along `sides`: 1, 2, 3 for x, y, z, negative for the opposite.
View view_of(std::initializer_list<int> sides, std::uint64_t seed) {
  View view;
  Random random(seed, "block view", 0);
  const Eigen::Vector3d half(60, 40, 30);
  for (const int side : sides) {
    const int axis = std::abs(side) - 1, u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double sign = side > 0 ? 1.0 : -1.0;
    const double from_u = random.uniform(0.0, 1.5), from_v = random.uniform(0.0, 1.5);
    for (double a = from_u - half[u]; a < half[u]; a += 1.5) {
      for (double b = from_v - half[v]; b < half[v]; b += 1.5) {
        Eigen::Vector3d point;
        point[axis] = sign * half[axis] + kViewNoise * random.normal();
        point[u] = a;
        point[v] = b;
        view.segment_in_scan.positions.push_back(point.cast<float>());
        view.segment_in_scan.normals.push_back((sign * Eigen::Vector3d::Unit(axis)).cast<float>());
      }
    }
  }
  view.noise_sigma_mm = kViewNoise;
  return view;
}

double apart(const Refinement& refinement) {
  const Pose motion = refinement.model_from_scan[0].inverse() * refinement.model_from_scan[1];
  double worst = 0.0;
  for (const Eigen::Vector3d& corner : block().vertices) worst = std::max(worst, (motion * corner - corner).norm());
  return worst;
}

Refinement refined(std::vector<View> views, bool loose_on_model, const Eigen::Vector3d& start) {
  views[1].model_from_scan.translation() = start;
  const TriangleMesh mesh = block();
  const model::SurfaceDistance surface(mesh);
  RefineOptions options;
  options.loose_on_model = loose_on_model;
  const std::vector<Link> links{{0, 1}};
  return refine_on_model(views, links, surface, diameter(mesh), options, Context(2)).value();
}

// Both see the top only, and each two sides that the other does not see: what they share leaves two slides and a turn,
// which each view's own sides say against the CAD.
TEST(LooseViews, AreHeldAgainstTheModelWhereTheyDoNotHoldOneAnother) {
  const std::vector<View> views{view_of({3, 1, 2}, 1), view_of({3, -1, -2}, 2)};
  const Eigen::Vector3d start(1.5, -1.0, 0.3);
  const Refinement alone = refined(views, false, start), with = refined(views, true, start);
  EXPECT_FALSE(alone.firmly_held);
  EXPECT_GT(apart(alone), 1.0) << "nothing moved it";
  EXPECT_LT(apart(with), kViewNoise);
  EXPECT_EQ(with.covariance.size(), 2U);
  EXPECT_LT(std::sqrt(with.covariance[1 - with.fixed_view](3, 3)), 0.2) << "and it is known to be there";
}

TEST(LooseViews, AreNotAskedOfTheModelWhereTheyHoldOneAnother) {
  std::vector<View> views{view_of({3, 1, 2}, 1), view_of({3, 1, 2}, 2)};
  const Eigen::Vector3d start(0.6, -0.4, 0.3);
  const Refinement alone = refined(views, false, start), with = refined(views, true, start);
  EXPECT_TRUE(alone.firmly_held);
  for (std::size_t v = 0; v < 2; ++v) {
    EXPECT_EQ(alone.model_from_scan[v].matrix(), with.model_from_scan[v].matrix()) << "to the bit";
  }
  EXPECT_LT(apart(with), kViewNoise);
}

// The CAD is shorter than the part by 2 mm along x. Two views that hold one another do not care.
TEST(LooseViews, OfAPartThatDiffersFromItsModelAreHeldByOneAnotherFirst) {
  const std::vector<View> views{view_of({3, 1, 2, -1}, 1), view_of({3, 1, -2}, 2)};  // share the top and one end
  TriangleMesh shorter = block();
  for (Eigen::Vector3d& vertex : shorter.vertices) vertex.x() *= 59.0 / 60.0;
  const model::SurfaceDistance surface(shorter);
  const std::vector<Link> links{{0, 1}};
  const Refinement result = refine_on_model(views, links, surface, diameter(shorter), {}, Context(2)).value();
  const Pose motion = result.model_from_scan[0].inverse() * result.model_from_scan[1];
  EXPECT_NEAR(motion.translation().x(), 0.0, 2.0 * kViewNoise) << "held by what both see";
  EXPECT_NEAR(motion.translation().z(), 0.0, 2.0 * kViewNoise);
}

// Four views that agree leave slides open between them; a fifth, which is corrugated, is none of this part.
TEST(LooseViews, AreNotAskedOfTheModelWhileOneOfThemIsContradicted) {
  const TriangleMesh mesh = block();
  const model::SurfaceDistance surface(mesh);
  std::vector<View> views{view_of({3, 1, 2}, 1), view_of({3}, 2), view_of({3, -1, -2}, 3), view_of({3}, 5)};
  std::vector<Link> links{{0, 1}, {0, 2}, {1, 2}, {0, 3}, {1, 3}, {2, 3}};
  EXPECT_TRUE(refine_on_model(views, links, surface, diameter(mesh), {}, Context(2))->on_model);
  views.push_back(view_of({3, 1, 2}, 4));
  PointCloud& corrugated = views.back().segment_in_scan;
  for (std::size_t i = 0; i < corrugated.size(); ++i) {
    corrugated.positions[i] += 2.0F * std::sin(0.7F * corrugated.positions[i].sum()) * corrugated.normals[i];
  }
  for (int other = 0; other < 3; ++other) links.push_back({other, 4});
  const Refinement result = refine_on_model(views, links, surface, diameter(mesh), {}, Context(2)).value();
  EXPECT_FALSE(result.firmly_held);
  EXPECT_FALSE(result.on_model);
}

// A block with a step, 120 x 80 mm: 60 mm high where x < 0, 30 mm where x > 0.
TriangleMesh step() {
  TriangleMesh mesh;
  const double profile[6][2] = {{-60, -30}, {60, -30}, {60, 0}, {0, 0}, {0, 30}, {-60, 30}};
  for (const double y : {-40.0, 40.0}) {
    for (const auto& corner : profile) mesh.vertices.emplace_back(corner[0], y, corner[1]);
  }
  for (int i = 0; i < 6; ++i) {
    const int next = (i + 1) % 6;
    mesh.triangles.emplace_back(i, next + 6, next);
    mesh.triangles.emplace_back(i, i + 6, next + 6);
  }
  constexpr int kSide[4][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {3, 4, 5}};
  for (const auto& part : kSide) {
    mesh.triangles.emplace_back(part[0], part[1], part[2]);  // seen from -y
    mesh.triangles.emplace_back(part[0] + 6, part[2] + 6, part[1] + 6);
  }
  return mesh;
}

// Both levels of it, from above, short of the ends.
View from_above(std::uint64_t seed) {
  View view;
  Random random(seed, "step view", 0);
  for (double x = -50.0 + random.uniform(0.0, 1.0); x < 40.0; x += 1.0) {
    for (double y = -30.0 + random.uniform(0.0, 1.0); y < 30.0; y += 1.0) {
      const double z = (x < 0.0 ? 30.0 : 0.0) + kViewNoise * random.normal();
      view.segment_in_scan.positions.push_back(Eigen::Vector3d(x, y, z).cast<float>());
      view.segment_in_scan.normals.push_back(Eigen::Vector3f::UnitZ());
    }
  }
  view.noise_sigma_mm = kViewNoise;
  view.viewpoint.kind = scan::Viewpoint::Kind::point;
  view.viewpoint.value = {0.0, 0.0, 2000.0};
  return view;
}

// Nothing holds views from above along the step. One lies 8 mm further along it, so that the others saw through its
// upper level; but nine tenths of it lie on the CAD: it has strayed, and is no wrong pose that had to be dropped first.
TEST(LooseViews, AreAskedOfTheModelWhereOneHasStrayedOnIt) {
  const TriangleMesh mesh = step();
  const model::SurfaceDistance surface(mesh);
  std::vector<View> views;
  std::vector<Link> links;
  for (int v = 0; v < 5; ++v) {
    views.push_back(from_above(static_cast<std::uint64_t>(v)));
    for (int other = 0; other < v; ++other) links.push_back({other, v});
  }
  views[4].model_from_scan.translation().x() = 8.0;
  RefineOptions by_scans;
  by_scans.loose_on_model = false;
  const Refinement alone = refine(views, links, by_scans, Context(2)).value();
  const auto contradicted = view_against_others(views, links, alone, Context(2)).value();
  ASSERT_TRUE(contradicted.has_value());
  EXPECT_EQ(contradicted->view, 4);
  EXPECT_TRUE(contradicted->seen_through.has_value());
  EXPECT_TRUE(refine_on_model(views, links, surface, diameter(mesh), {}, Context(2))->on_model);
}

TEST(LooseViews, NeedOneFitEach) {
  const std::vector<View> views{view_of({3, 1, 2}, 1), view_of({3, -1, -2}, 2)};
  const std::vector<Link> links{{0, 1}};
  const std::vector<ModelFit> one_fit(1);
  const auto result = refine(views, links, {}, Context(1), one_fit);
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
}

TEST(LooseViews, AreLeftAloneInPaperMode) { EXPECT_FALSE(RefineOptions{}.as_published().loose_on_model); }

}  // namespace
}  // namespace asbuilt::refine
