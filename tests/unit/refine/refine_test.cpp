// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/refine.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <string_view>
#include <type_traits>

#include "property/refine/bumpy_body.h"

namespace asbuilt::refine {
namespace {

using ::testing::HasSubstr;

PointCloud noisy_plane(double sigma, double normal_noise, std::uint64_t seed) {
  PointCloud cloud;
  Random random(seed, "plane", 0);
  for (int i = 0; i < 3000; ++i) {
    cloud.positions.emplace_back(static_cast<float>(random.uniform(0.0, 100.0)),
                                 static_cast<float>(random.uniform(0.0, 60.0)),
                                 static_cast<float>(sigma * random.normal()));
    cloud.normals.push_back(Eigen::Vector3d(normal_noise * random.normal(), normal_noise * random.normal(), 1.0)
                                .normalized()
                                .cast<float>());
  }
  return cloud;
}

std::vector<View> two_planes(double sigma, double normal_noise) {
  std::vector<View> views(2);
  views[0].segment_in_scan = noisy_plane(sigma, normal_noise, 1);
  views[1].segment_in_scan = noisy_plane(sigma, normal_noise, 2);
  views[1].segment_in_scan.positions.pop_back();  // view 0 has most points: it is the fixed one
  views[1].segment_in_scan.normals.pop_back();
  Vector6d start;
  start << 0.004, -0.003, 0.0, 0.0, 0.0, 0.8;  // tilted and lifted: held; not slid or turned in its plane
  views[1].model_from_scan = pose_from_twist(start);
  return views;
}

TEST(Refine, TwoViewsOfAPlaneReportTheirThreeFreeDirectionsAndStay) {
  for (const double noise : {0.0, 0.02}) {
    const std::vector<View> views = two_planes(0.05 * (noise > 0.0), noise);
    const Refinement result = refine::refine(views, std::vector<Link>{{0, 1}}, {}, Context(2)).value();
    const Pose& pose = result.model_from_scan[1];
    ASSERT_TRUE(pose.matrix().allFinite() && result.covariance[1].allFinite());
    EXPECT_EQ(result.unheld.size(), 3U) << "two slides and a turn, normal noise " << noise;
    for (const UnheldDirection& direction : result.unheld) {
      EXPECT_EQ(direction.view, 1);
      EXPECT_TRUE(direction.twist.allFinite());
      EXPECT_LT(direction.eigenvalue, 0.01);
      EXPECT_LT(direction.twist.head<2>().norm() * 50.0 + std::abs(direction.twist[5]), 0.1) << direction.twist;
    }
    // What is held is found ...
    EXPECT_NEAR((pose * Eigen::Vector3d(50, 30, 0)).z(), 0.0, 0.01);
    EXPECT_NEAR((pose.linear() * Eigen::Vector3d::UnitZ()).z(), 1.0, 1e-7);
    // ... and what is not has not been moved (levelling the tilt about a point off the origin shifts by second order).
    EXPECT_LT((pose * Eigen::Vector3d(50, 30, 0) - Eigen::Vector3d(50, 30, 0)).head<2>().norm(), 0.05);
    // A slide is unknown by the size of the part, the height is known.
    EXPECT_GT(std::sqrt(result.covariance[1](3, 3)), 50.0);
  }
}

// Of a link that holds what an ideal surface holds: what is free, and what is not.
void expect_three_free(const LinkHold& hold) {
  EXPECT_EQ((hold.held.array() < hold.threshold).count(), 3) << hold.held.transpose();
  ASSERT_EQ(hold.free.size(), 3U);
}

TEST(Refine, ALinkOfPlanesIsSaidToSlideTwiceAndToTurnAboutItsNormal) {
  const std::vector<View> views = two_planes(0.05, 0.02);
  const Refinement result = refine::refine(views, std::vector<Link>{{0, 1}}, {}, Context(2)).value();
  ASSERT_EQ(result.link_holds.size(), 1U);
  expect_three_free(result.link_holds[0]);
  for (std::size_t i = 0; i < 3; ++i) {
    const Motion& motion = result.link_holds[0].free[i];
    EXPECT_EQ(motion.is_turn, i == 2);
    EXPECT_NEAR(std::abs(motion.direction.z()), i == 2 ? 1.0 : 0.0, 0.05);
  }
  ASSERT_EQ(result.view_holds.size(), 2U);
  EXPECT_TRUE(result.view_holds[0].loose.empty()) << "the fixed view";
  const ViewHold& hold = result.view_holds[1];
  ASSERT_EQ(hold.loose.size(), 3U);
  for (const LooseMotion& loose : hold.loose) EXPECT_TRUE(loose.unheld);
  // The plane's height is the mean of its points: sigma / sqrt(number) within what both ways and two clouds make of it.
  EXPECT_GT(hold.sigma_mm[2], 50.0);
  EXPECT_LT(hold.sigma_mm[3], 0.05);
  EXPECT_GT(hold.sigma_mm[5], 0.0);
}

TEST(Refine, ALinkOfTwoWallsIsSaidToSlideAlongTheirEdge) {
  // An angle profile along (1, 2, 2) / 3: two planes that meet there.
  const Eigen::Vector3d along = Eigen::Vector3d(1, 2, 2) / 3.0, up = Eigen::Vector3d(2, 1, -2) / 3.0,
                        side = along.cross(up);
  std::vector<View> views(2);
  for (std::size_t v = 0; v < 2; ++v) {
    Random random(3, "angle", v);
    for (int i = 0; i < 6000; ++i) {
      const Eigen::Vector3d normal = i % 2 == 0 ? up : side, other = i % 2 == 0 ? side : up;
      const Eigen::Vector3d point =
          random.uniform(0.0, 100.0) * along + random.uniform(1.0, 40.0) * other + 0.02 * random.normal() * normal;
      views[v].segment_in_scan.positions.push_back(point.cast<float>());
      views[v].segment_in_scan.normals.push_back(normal.cast<float>());
    }
  }
  const Refinement result = refine::refine(views, std::vector<Link>{{0, 1}}, {}, Context(2)).value();
  ASSERT_EQ(result.link_holds.at(0).free.size(), 1U) << result.link_holds[0].held.transpose();
  const Motion& slide = result.link_holds[0].free[0];
  EXPECT_FALSE(slide.is_turn);
  EXPECT_NEAR(slide.direction.dot(along), 1.0, 1e-3);
  ASSERT_EQ(result.view_holds.at(1).loose.size(), 1U);
  EXPECT_TRUE(result.view_holds[1].loose[0].unheld);
  EXPECT_FALSE(result.view_holds[1].loose[0].motion.is_turn);
  EXPECT_NEAR(result.view_holds[1].loose[0].motion.direction.dot(along), 1.0, 1e-3);
}

TEST(Refine, ACylinderSlidesAlongAndTurnsAboutItsAxisOnly) {
  std::vector<View> views(2);
  for (std::size_t v = 0; v < 2; ++v) {
    Random random(9, "cylinder", v);
    for (int i = 0; i < 4000; ++i) {
      const double turn = random.uniform(0.0, 3.0), z = random.uniform(0.0, 80.0);
      const Eigen::Vector3d normal(std::cos(turn), std::sin(turn), 0.0);
      views[v].segment_in_scan.positions.push_back(
          (20.0 * normal + z * Eigen::Vector3d::UnitZ() + 0.02 * random.normal() * normal).cast<float>());
      views[v].segment_in_scan.normals.push_back(normal.cast<float>());
    }
  }
  views[1].model_from_scan.translation() = Eigen::Vector3d(0.3, -0.2, 0.0);
  const Refinement result = refine::refine(views, std::vector<Link>{{0, 1}}, {}, Context(2)).value();
  EXPECT_EQ(result.unheld.size(), 2U);
  ASSERT_EQ(result.link_holds.at(0).free.size(), 2U) << result.link_holds[0].held.transpose();
  ASSERT_EQ(result.view_holds.at(1).loose.size(), 2U);
  for (const bool turn : {false, true}) {
    for (const Motion& motion :
         {result.link_holds[0].free[turn ? 1 : 0], result.view_holds[1].loose[turn ? 1 : 0].motion}) {
      EXPECT_EQ(motion.is_turn, turn);
      EXPECT_GT(std::abs(motion.direction.z()), 0.999);
      if (turn) {
        EXPECT_LT(motion.through.head<2>().norm(), 1.0) << "the axis of the cylinder";
      }
    }
  }
  const Eigen::Vector3d axis_point = result.model_from_scan[1] * Eigen::Vector3d(0, 0, 40);
  EXPECT_LT((axis_point - Eigen::Vector3d(0, 0, 40)).norm(), 0.02);
}

TEST(Refine, WhatIsHeldOnAllSidesIsNotSaidToBeLoose) {
  const test::Scene scene = test::bumpy_scene({}, 1);
  const Refinement result = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  ASSERT_EQ(result.view_holds.size(), scene.views.size());
  for (const ViewHold& hold : result.view_holds) EXPECT_TRUE(hold.loose.empty());
  for (const LinkHold& hold : result.link_holds) {
    EXPECT_TRUE(hold.free.empty());
    EXPECT_LE(hold.held[5], 1.0 + 1e-9);
  }
}

TEST(Refine, OneViewAloneStaysWhereItIs) {
  const test::Scene scene = test::bumpy_scene({}, 1);
  const std::vector<View> one{scene.views[0]};
  const Refinement result = refine::refine(one, {}, {}, Context(1)).value();
  EXPECT_EQ(result.model_from_scan[0].matrix(), scene.views[0].model_from_scan.matrix());
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.covariance.size(), 1U);
}

TEST(Refine, PerfectDataAreRefinedWithoutNoiseToMeasureBy) {
  test::SceneOptions options;
  options.sigma = 0.0;
  options.normal_noise = 0.0;
  options.views = 5;
  const test::Scene scene = test::bumpy_scene(options, 2);
  const Refinement result = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  EXPECT_LT(test::relative_pose_error(scene, result.model_from_scan), 0.02);
}

TEST(Refine, GoesOnFromAnEarlierRefinementInFewerStepsToTheSamePoses) {
  const test::Scene scene = test::bumpy_scene({}, 3);
  const Refinement first = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  ASSERT_EQ(first.handed_on.size(), scene.views.size());
  std::vector<View> refined = scene.views;
  for (std::size_t v = 0; v < refined.size(); ++v) refined[v].model_from_scan = first.model_from_scan[v];
  const Refinement cold = refine::refine(refined, scene.links, {}, Context(2)).value();
  for (std::size_t v = 0; v < refined.size(); ++v) {
    EXPECT_GT(first.handed_on[v].reach_mm, 0.0);
    refined[v].earlier = first.handed_on[v];
  }
  const Refinement again = refine::refine(refined, scene.links, {}, Context(2)).value();
  EXPECT_TRUE(again.converged);
  EXPECT_LT(again.iterations, cold.iterations);
  EXPECT_LT(again.iterations, first.iterations);
  EXPECT_LT(test::relative_pose_error(scene, again.model_from_scan),
            test::relative_pose_error(scene, cold.model_from_scan) + 0.05);
}

TEST(Refine, AViewThatNothingWasHandedOnToIsLookedForFromAfar) {
  test::Scene scene = test::bumpy_scene({}, 3);
  const Refinement expected = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  for (std::size_t v = 1; v < scene.views.size(); ++v) scene.views[v].earlier = {0.1};
  const Refinement result = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    EXPECT_EQ(result.model_from_scan[v].matrix(), expected.model_from_scan[v].matrix()) << v;
  }
}

TEST(Refine, LinksThatLeavePiecesAreNotPossible) {
  const test::Scene scene = test::bumpy_scene({}, 1);
  const auto result = refine::refine(scene.views, std::vector<Link>{{0, 1}, {2, 3}}, {}, Context(1));
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::not_possible);
  EXPECT_THAT(result.error().message, HasSubstr("4 pieces"));
}

TEST(Refine, ViewsThatShareNothingAreNotPossible) {
  std::vector<View> views = two_planes(0.0, 0.0);
  views[1].model_from_scan.translation().x() = 1e4;
  const auto result = refine::refine(views, std::vector<Link>{{0, 1}}, {}, Context(1));
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::not_possible);
}

TEST(Refine, BadInputIsRefusedByName) {
  const std::vector<View> good = two_planes(0.1, 0.01);
  const std::vector<Link> link{{0, 1}};
  const auto message = [&](const std::vector<View>& views, const std::vector<Link>& links) {
    const auto result = refine::refine(views, links, {}, Context(1));
    return result ? std::string("accepted") : result.error().message;
  };
  EXPECT_THAT(message({}, {}), HasSubstr("no views"));
  std::vector<View> bad = good;
  bad[1].segment_in_scan = {};
  EXPECT_THAT(message(bad, link), HasSubstr("view 1 has no points"));
  bad = good;
  bad[0].segment_in_scan.normals.clear();
  EXPECT_THAT(message(bad, link), HasSubstr("view 0 has 0 normals"));
  bad = good;
  bad[1].segment_in_scan.positions[5].y() = std::numeric_limits<float>::infinity();
  EXPECT_THAT(message(bad, link), HasSubstr("view 1: point 5 is not finite"));
  bad = good;
  bad[0].model_from_scan.linear() *= 1.5;
  EXPECT_THAT(message(bad, link), HasSubstr("pose of view 0"));
  bad = good;
  bad[0].noise_sigma_mm = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message(bad, link), HasSubstr("noise of view 0"));
  EXPECT_THAT(message(good, {{0, 2}}), HasSubstr("link 0 - 2"));
  EXPECT_THAT(message(good, {{1, 1}}), HasSubstr("link 1 - 1"));
}

TEST(Refine, OptionsOutOfRangeAreRefused) {
  const auto refused = [](auto change) {
    RefineOptions options;
    change(options);
    return !options.validate();
  };
  EXPECT_TRUE(RefineOptions{}.validate());
  EXPECT_TRUE(refused([](RefineOptions& o) { o.points_per_scan = 10; }));
  EXPECT_TRUE(refused([](RefineOptions& o) { o.max_iterations = 0; }));
  EXPECT_TRUE(refused([](RefineOptions& o) { o.max_normal_angle_deg = 120.0; }));
  EXPECT_TRUE(refused([](RefineOptions& o) { o.start_distance_ratio = 0.0; }));
  EXPECT_TRUE(refused([](RefineOptions& o) { o.converged_motion = std::nan(""); }));
}

TEST(Refine, AsPublishedIsEverySwitchOff) {
  RefineOptions published = RefineOptions{}.as_published();
  EXPECT_TRUE(published.paper_mode);
  for_each_field(published, [](std::string_view name, const auto& value, std::string_view) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, bool>) {
      EXPECT_FALSE(value) << name;
    }
  });
}

TEST(Refine, KeepingMatchesEndsWhereSearchingAlwaysEnds) {
  const test::Scene scene = test::bumpy_scene({}, 6);
  RefineOptions always;
  always.keep_matches = false;
  const Refinement kept = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  const Refinement searched = refine::refine(scene.views, scene.links, always, Context(2)).value();
  double largest = 0.0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    for (const Eigen::Vector3f& point : scene.views[v].segment_in_scan.positions) {
      const Eigen::Vector3d p = point.cast<double>();
      largest = std::max(largest, (kept.model_from_scan[v] * p - searched.model_from_scan[v] * p).norm());
    }
  }
  EXPECT_LT(largest, 0.02);  // a fifth of the noise of one point (0.1 mm); either stops at motions of 0.002 mm
}

TEST(Refine, SamplesMadeBeforehandChangeNothing) {
  test::Scene scene = test::bumpy_scene({}, 6);
  const Refinement without = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  const auto expect_the_same = [&] {
    const Refinement with = refine::refine(scene.views, scene.links, {}, Context(2)).value();
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      EXPECT_EQ(with.model_from_scan[v].matrix(), without.model_from_scan[v].matrix());
      EXPECT_EQ(with.covariance[v], without.covariance[v]);
    }
  };
  RefineOptions few;
  few.points_per_scan = 500;
  sample_views(scene.views, few, Context(2));
  for (const View& view : scene.views) ASSERT_TRUE(view.sample);
  expect_the_same();  // those of other rules are passed over
  sample_views(scene.views, {}, Context(2));
  expect_the_same();
  const auto kept = scene.views[0].sample;
  sample_views(scene.views, {}, Context(2));
  EXPECT_EQ(scene.views[0].sample, kept) << "it was made twice";
}

TEST(Refine, ViewsThatAreRefusedAreNotSampled) {
  std::vector<View> views(3);
  views[1].segment_in_scan.positions.emplace_back(0.0F, 0.0F, 0.0F);  // no normal
  views[2].segment_in_scan.positions.emplace_back(std::nanf(""), 0.0F, 0.0F);
  views[2].segment_in_scan.normals.push_back(Eigen::Vector3f::UnitZ());
  sample_views(views, {}, Context(1));
  for (const View& view : views) EXPECT_FALSE(view.sample);
}

TEST(Refine, StopsWhenAskedTo) {
  const test::Scene scene = test::bumpy_scene({}, 1);
  std::stop_source stop;
  stop.request_stop();
  Context context(2);
  context.stop = stop.get_token();
  const auto result = refine::refine(scene.views, scene.links, {}, context);
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().code, ErrorCode::cancelled);
}

TEST(Refine, EveryLinkIsReportedBothWays) {
  const test::Scene scene = test::bumpy_scene({}, 1);
  const Refinement result = refine::refine(scene.views, scene.links, {}, Context(2)).value();
  ASSERT_EQ(result.edges.size(), 2 * scene.links.size());
  for (std::size_t l = 0; l < scene.links.size(); ++l) {
    EXPECT_EQ(result.edges[2 * l].first, result.edges[2 * l + 1].second);
    EXPECT_EQ(result.edges[2 * l].second, result.edges[2 * l + 1].first);
    EXPECT_GT(result.edges[2 * l].pairs, 50U);
    // Two scans with a noise of 0.1 mm along their own lines of sight.
    EXPECT_GT(result.edges[2 * l].rms_mm, 0.05);
    EXPECT_LT(result.edges[2 * l].rms_mm, 0.2);
  }
}

}  // namespace
}  // namespace asbuilt::refine
