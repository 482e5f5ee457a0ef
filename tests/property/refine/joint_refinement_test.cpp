// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "asbuilt/refine/suspicious_view.h"
#include "property/refine/bumpy_body.h"

namespace asbuilt::refine {
namespace {

using test::bumpy_scene;
using test::relative_pose_error;
using test::Scene;
using test::SceneOptions;
using test::starting_poses;

Refinement refined(const Scene& scene, const RefineOptions& options = {}, int threads = 2) {
  return refine::refine(scene.views, scene.links, options, Context(threads)).value();
}

// Largest distance between where two sets of poses put the same point of a scan, mm.
double largest_difference(const Scene& scene, const std::vector<Pose>& a, const std::vector<Pose>& b) {
  double largest = 0.0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    for (const Eigen::Vector3f& point : scene.views[v].segment_in_scan.positions) {
      largest = std::max(largest, (a[v] * point.cast<double>() - b[v] * point.cast<double>()).norm());
    }
  }
  return largest;
}

// A run stops when no view moves by more than 0.02 sigma (0.1 mm) a step; another order of summation tips a few matches
// over and stops elsewhere within a few such steps.
constexpr double kStoppingNoise = 0.01;

TEST(JointRefinement, EndsWithinHalfASigmaOfTheTruth) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    for (const bool symmetric : {false, true}) {
      const SceneOptions options;
      const Scene scene = bumpy_scene(options, seed);
      RefineOptions refine_options;
      refine_options.symmetric = symmetric;
      const Refinement result = refined(scene, refine_options);
      EXPECT_TRUE(result.converged);
      EXPECT_THAT(result.unheld, testing::IsEmpty());
      EXPECT_LT(relative_pose_error(scene, result.model_from_scan), 0.5 * options.sigma)
          << "seed " << seed << ", start " << relative_pose_error(scene, starting_poses(scene));
      EXPECT_LT(result.rms_after_mm, result.rms_before_mm);
    }
  }
}

TEST(JointRefinement, RecoversStartsThatAreOnePercentOfTheDiameterOff) {
  SceneOptions options;
  options.sigma = 0.02;
  options.start_error = 2.0;  // one per cent shift and as much again by rotation, each view its own way
  for (std::uint64_t seed = 20; seed < 25; ++seed) {
    const Scene scene = bumpy_scene(options, seed);
    ASSERT_GT(relative_pose_error(scene, starting_poses(scene)), 0.8);
    EXPECT_LT(relative_pose_error(scene, refined(scene).model_from_scan), 0.02) << "seed " << seed;
  }
}

TEST(JointRefinement, KeepsTheFixedViewWhereItWas) {
  const Scene scene = bumpy_scene({}, 1);
  const Refinement result = refined(scene);
  const auto fixed = static_cast<std::size_t>(result.fixed_view);
  for (const View& view : scene.views) {
    EXPECT_LE(view.segment_in_scan.size(), scene.views[fixed].segment_in_scan.size());
  }
  EXPECT_EQ(result.model_from_scan[fixed].matrix(), scene.views[fixed].model_from_scan.matrix());
  EXPECT_EQ(result.covariance[fixed], Matrix6d::Zero());
}

TEST(JointRefinement, MovingAllViewsMovesTheResult) {
  const Scene scene = bumpy_scene({}, 2);
  Scene moved = scene;
  Random random(2, "motion", 0);
  const Pose motion = test::random_pose(random, 2.0, 500.0);
  for (View& view : moved.views) view.model_from_scan = motion * view.model_from_scan;
  const Refinement here = refined(scene), there = refined(moved);
  std::vector<Pose> expected;
  for (const Pose& pose : here.model_from_scan) expected.push_back(motion * pose);
  EXPECT_LT(largest_difference(scene, there.model_from_scan, expected), kStoppingNoise);
}

TEST(JointRefinement, TheOrderOfViewsAndLinksDoesNotMatter) {
  const Scene scene = bumpy_scene({}, 3);
  const Refinement expected = refined(scene);
  std::vector<int> order(scene.views.size());
  std::iota(order.begin(), order.end(), 0);
  std::mt19937 shuffler(5);
  std::ranges::shuffle(order, shuffler);
  Scene shuffled;
  std::vector<int> place(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    shuffled.views.push_back(scene.views[static_cast<std::size_t>(order[i])]);
    place[static_cast<std::size_t>(order[i])] = static_cast<int>(i);
  }
  for (const Link& link : scene.links) {
    shuffled.links.push_back(
        {place[static_cast<std::size_t>(link.second)], place[static_cast<std::size_t>(link.first)]});
  }
  std::ranges::shuffle(shuffled.links, shuffler);
  const Refinement result = refined(shuffled);
  std::vector<Pose> in_order(order.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    in_order[static_cast<std::size_t>(order[i])] = result.model_from_scan[i];
  }
  EXPECT_LT(largest_difference(scene, in_order, expected.model_from_scan), kStoppingNoise);
}

TEST(JointRefinement, IsTheSameToTheLastBitOnOneTwoAndThreeThreads) {
  SceneOptions options;
  options.points = 30000;  // so that the first steps run on a thinned sample
  options.views = 5;
  const Scene scene = bumpy_scene(options, 4);
  const Refinement one = refined(scene, {}, 1);
  for (const int threads : {2, 3}) {
    const Refinement many = refined(scene, {}, threads);
    EXPECT_EQ(many.iterations, one.iterations);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      EXPECT_EQ(many.model_from_scan[v].matrix(), one.model_from_scan[v].matrix()) << threads;
      EXPECT_EQ(many.covariance[v], one.covariance[v]) << threads;
    }
  }
}

// Squared errors of many runs with the same geometry over what the runs claim.
double actual_over_claimed(SceneOptions options) {
  double actual = 0.0, claimed = 0.0;
  options.views = 5;
  options.start_error = 0.0;  // the fixed view stands at its truth, so errors are absolute
  for (std::uint64_t seed = 40; seed < 48; ++seed) {
    const Scene scene = bumpy_scene(options, seed);
    const Refinement result = refined(scene);
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      if (static_cast<int>(v) == result.fixed_view) continue;
      const Pose error = result.model_from_scan[v] * scene.truth[v].inverse();
      actual += error.translation().squaredNorm();
      claimed += result.covariance[v].bottomRightCorner<3, 3>().trace();
    }
  }
  return actual / claimed;
}

TEST(JointRefinement, CovarianceHasTheSizeOfTheActualError) {
  const double ratio = actual_over_claimed({});
  RecordProperty("actual_over_claimed", std::to_string(ratio));
  EXPECT_LT(ratio, 4.0);
  EXPECT_GT(ratio, 0.25);
}

TEST(JointRefinement, CovarianceHasTheSizeOfTheActualErrorWhereNeighboursErrAlike) {
  SceneOptions options;
  options.sigma = 0.03;
  options.alike_error = 0.1;
  const double ratio = actual_over_claimed(options);
  RecordProperty("actual_over_claimed", std::to_string(ratio));
  EXPECT_LT(ratio, 6.0);  // of independent errors, 33 and more would be as good
  EXPECT_GT(ratio, 0.25);
}

TEST(JointRefinement, PaperModeIsNearTheTruthToo) {
  const SceneOptions options;
  const Scene scene = bumpy_scene(options, 0);
  RefineOptions paper;
  paper.paper_mode = true;
  const Refinement result = refined(scene, paper);
  // Closest points beyond the border of the other scan are part of the published sum: a bias of a few sigma remains.
  EXPECT_LT(relative_pose_error(scene, result.model_from_scan), 3.0 * options.sigma);
}

TEST(JointRefinement, AViewThatStandsWrongIsNamedAndTheOthersAreNot) {
  SceneOptions options;
  options.views = 6;
  for (std::uint64_t seed = 60; seed < 63; ++seed) {
    Scene scene = bumpy_scene(options, seed);
    EXPECT_FALSE(suspicious_view(6, refined(scene).edges, 0.0).has_value()) << "seed " << seed;
    // Turned by 70 degrees about the body's centre: still on the body, nowhere in agreement with its bumps. (25 degrees
    // are not enough for this test: the refinement finds its way back from there.)
    Vector6d turn = Vector6d::Zero();
    turn.head<3>() = Eigen::Vector3d(0.9, 0.6, -0.6);
    scene.views[2].model_from_scan = pose_from_twist(turn) * scene.views[2].model_from_scan;
    for (const int other : {0, 1, 3, 4, 5}) {
      const bool linked = std::ranges::any_of(scene.links, [&](const Link& link) {
        return std::min(link.first, link.second) == std::min(2, other) &&
               std::max(link.first, link.second) == std::max(2, other);
      });
      if (!linked) scene.links.push_back({2, other});
    }
    const auto suspicious = suspicious_view(6, refined(scene).edges, 0.0);
    ASSERT_TRUE(suspicious.has_value()) << "seed " << seed;
    EXPECT_EQ(suspicious->view, 2) << "seed " << seed;
  }
}

}  // namespace
}  // namespace asbuilt::refine
