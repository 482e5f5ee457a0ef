// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/link_evidence.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>

#include "asbuilt/core/random.h"
#include "asbuilt/refine/suspicious_view.h"

namespace asbuilt::refine {
namespace {

// A plate in the plane z = `height`, facing a sensor 1 m above the origin. The scan frame is the model frame.
View plate_seen_from_above(float height) {
  View view;
  for (int i = -30; i <= 30; ++i) {
    for (int j = -30; j <= 30; ++j) {
      view.segment_in_scan.positions.emplace_back(static_cast<float>(i), static_cast<float>(j), height);
      view.segment_in_scan.normals.push_back(Eigen::Vector3f::UnitZ());
    }
  }
  view.noise_sigma_mm = 0.05;
  view.viewpoint.kind = scan::Viewpoint::Kind::point;
  view.viewpoint.value = Eigen::Vector3d(0.0, 0.0, 1000.0);
  return view;
}

std::vector<Link> all_pairs(int views) {
  std::vector<Link> links;
  for (int a = 0; a < views; ++a) {
    for (int b = a + 1; b < views; ++b) links.push_back({a, b});
  }
  return links;
}

std::vector<Pose> poses_of(const std::vector<View>& views) {
  std::vector<Pose> poses;
  for (const View& view : views) poses.push_back(view.model_from_scan);
  return poses;
}

TEST(LinkEvidence, OfViewsThatAgreeHoldsNoContradiction) {
  const std::vector<View> views(4, plate_seen_from_above(0.0F));
  const auto evidence = link_evidence(views, poses_of(views), all_pairs(4), Context(2)).value();
  ASSERT_EQ(evidence.size(), 6U);
  for (const LinkEvidence& link : evidence) {
    EXPECT_EQ(link.contradicting, 0U);
    EXPECT_GT(link.agreeing, 1000U);
  }
  EXPECT_FALSE(contradicted_view(4, evidence));
}

TEST(LinkEvidence, AViewThatTheOthersLookThroughIsNamed) {
  std::vector<View> views(5, plate_seen_from_above(0.0F));
  views[3].model_from_scan.translation().z() = 20.0;  // far beyond spacing and noise
  const auto evidence = link_evidence(views, poses_of(views), all_pairs(5), Context(2)).value();
  const auto found = contradicted_view(5, evidence);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->view, 3);
  EXPECT_GT(found->share, 0.5);
  EXPECT_EQ(found->usual_share, 0.0);
}

TEST(LinkEvidence, TwoAgainstTwoNameNobody) {
  std::vector<View> views(4, plate_seen_from_above(0.0F));
  views[2].model_from_scan.translation().z() = 20.0;
  views[3].model_from_scan.translation().z() = 20.0;
  const auto evidence = link_evidence(views, poses_of(views), all_pairs(4), Context(2)).value();
  const auto found = contradicted_view(4, evidence);
  // Nobody is clearly worse than the usual other: all are contradicted by half of what they are linked to.
  EXPECT_FALSE(found.has_value());
}

TEST(LinkEvidence, ViewsWithoutAViewpointSeeNothing) {
  std::vector<View> views(2, plate_seen_from_above(0.0F));
  for (View& view : views) view.viewpoint = {};
  views[1].model_from_scan.translation().z() = 20.0;
  const auto evidence = link_evidence(views, poses_of(views), all_pairs(2), Context(1)).value();
  EXPECT_EQ(evidence[0].agreeing + evidence[0].contradicting, 0U);
  EXPECT_EQ(evidence[0].share(), 0.0);
}

constexpr int kOnRing = 12;

// Of the views that are left of a ring: those up to three places apart are linked.
std::vector<Link> links_on_ring(const std::vector<int>& left) {
  std::vector<Link> links;
  for (std::size_t a = 0; a < left.size(); ++a) {
    for (std::size_t b = a + 1; b < left.size(); ++b) {
      const int one_way = left[b] - left[a];
      if (std::min(one_way, kOnRing - one_way) <= 3) links.push_back({static_cast<int>(a), static_cast<int>(b)});
    }
  }
  return links;
}

// Refines from the starting poses, asks, drops who is named, and again until nobody is.
struct Dropping {
  Dropping(const std::vector<View>& starts, const RefineOptions& options) : left(starts.size()) {
    std::iota(left.begin(), left.end(), 0);
    while (true) {
      std::vector<View> views;
      for (const int view : left) views.push_back(starts[static_cast<std::size_t>(view)]);
      const std::vector<Link> links = links_on_ring(left);
      refinement = refine(views, links, options, Context(2)).value();
      const auto found = view_against_others(views, links, refinement, Context(2)).value();
      if (!found) return;
      dropped.push_back(left[static_cast<std::size_t>(found->view)]);
      left.erase(left.begin() + found->view);
    }
  }

  std::vector<int> left, dropped;
  Refinement refinement;  // of those that are left
};

TEST(ViewAgainstOthers, TwoOfTwelveThatStandWrongAreDroppedOneAfterTheOtherAndNobodyElse) {
  RefineOptions options;
  options.points_per_scan = 500;  // enough for a plate
  // The others look through what is lifted, and what is sunk looks through them; the last two agree with one another.
  for (const double second_mm : {-12.0, 20.0}) {
    std::vector<View> views(kOnRing, plate_seen_from_above(0.0F));
    Random random(1, "plates on a ring", 0);
    for (View& view : views) view.model_from_scan.translation().z() = random.uniform(-0.3, 0.3);
    views[4].model_from_scan.translation().z() = 20.0;  // further off than correspondences are searched
    views[6].model_from_scan.translation().z() = second_mm;
    const Dropping result(views, options);
    EXPECT_THAT(result.dropped, testing::UnorderedElementsAre(4, 6)) << second_mm;
    // The data are perfect, and a step of a fiftieth of the noise ends it.
    const Pose first_from_model = result.refinement.model_from_scan[0].inverse();
    for (const Pose& pose : result.refinement.model_from_scan) {
      EXPECT_NEAR((first_from_model * pose).translation().z(), 0.0, 0.2 * views[0].noise_sigma_mm) << second_mm;
    }
  }
}

TEST(SeenThrough, MarksWhatOthersLookedThroughAndNothingElse) {
  std::vector<View> views(3, plate_seen_from_above(0.0F));
  PointCloud& first = views[0].segment_in_scan;
  const std::size_t plate = first.size();
  first.positions.emplace_back(5.0F, 5.0F, 40.0F);  // floats above the plate
  first.normals.push_back(Eigen::Vector3f::UnitZ());
  const auto marked = seen_through(views, poses_of(views), all_pairs(3), Context(2)).value();
  ASSERT_EQ(marked[0].size(), plate + 1);
  EXPECT_EQ(std::count(marked[0].begin(), marked[0].begin() + static_cast<std::ptrdiff_t>(plate), 1), 0);
  EXPECT_EQ(marked[0].back(), 1);
  for (const std::size_t other : {1U, 2U}) {
    // The floating point hides some of the plate from the first view, and shows through nothing.
    EXPECT_EQ(std::count(marked[other].begin(), marked[other].end(), 1), 0);
  }
}

}  // namespace
}  // namespace asbuilt::refine
