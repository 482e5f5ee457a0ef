// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/link_evidence.h"

#include <gmock/gmock.h>

#include <algorithm>

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
