// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/graph/pose_graph.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>

#include "property/graph/sphere_views.h"

namespace asbuilt::graph {
namespace {

using test::cap;
using test::sphere_model;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const Eigen::Vector3d kAbove = Eigen::Vector3d::UnitZ(), kBelow = -Eigen::Vector3d::UnitZ();

TEST(PoseGraph, OppositeViewsAreTwoPiecesAndThatIsAResult) {
  const std::vector<PosedSegment> segments{cap(kAbove, 0.5, Pose::Identity()), cap(kBelow, 0.6, Pose::Identity()),
                                           cap(kAbove, 0.6, Pose::Identity())};
  const PoseGraph graph = build_graph(segments, sphere_model(), {}, Context(1)).value();
  EXPECT_THAT(graph.components, ElementsAre(ElementsAre(0, 2), ElementsAre(1)));
  EXPECT_EQ(best_missing_link(graph).first, -1) << "the pieces share nothing";
}

TEST(PoseGraph, TheBestMissingLinkIsTheStrongestBarBetweenPieces) {
  PoseGraphOptions options;
  options.edges.low = options.edges.high = 0.5;
  const Eigen::Vector3d side(std::sin(0.9), 0.0, std::cos(0.9));
  const std::vector<PosedSegment> segments{cap(kAbove, 0.6, Pose::Identity()), cap(side, 0.6, Pose::Identity())};
  const PoseGraph graph = build_graph(segments, sphere_model(), options, Context(1)).value();
  ASSERT_EQ(graph.components.size(), 2U);
  EXPECT_EQ(best_missing_link(graph), graph.overlaps.front());
}

TEST(PoseGraph, AnEmptySegmentIsANodeWithoutLinks) {
  const std::vector<PosedSegment> segments{cap(kAbove, 0.6, Pose::Identity()), PosedSegment{}};
  const PoseGraph graph = build_graph(segments, sphere_model(), {}, Context(1)).value();
  EXPECT_THAT(graph.overlaps, testing::IsEmpty());
  EXPECT_THAT(graph.components, ElementsAre(ElementsAre(0), ElementsAre(1)));
}

TEST(PoseGraph, NoScansMakeAnEmptyGraph) {
  const PoseGraph graph = build_graph({}, sphere_model(), {}, Context(1)).value();
  EXPECT_TRUE(graph.overlaps.empty() && graph.edges.empty() && graph.components.empty());
}

TEST(PoseGraph, SparseAndDenseScansOfOnePlaceOverlapAlike) {
  const auto overlap = [](int density) {
    const Eigen::Vector3d side(std::sin(0.5), 0.0, std::cos(0.5));
    const std::vector<PosedSegment> segments{cap(kAbove, 0.8, Pose::Identity(), 40000),
                                             cap(side, 0.8, Pose::Identity(), density)};
    return build_graph(segments, sphere_model(), {}, Context(1)).value().overlaps.front().overlap;
  };
  // At 4000 points on the sphere a voxel of 3.5 mm holds one or two: model samples fill what the scan leaves open.
  EXPECT_NEAR(overlap(4000), overlap(40000), 0.03);
}

TEST(PoseGraph, BadInputIsRefusedAndLeavesTheGraphAsItWas) {
  PoseGraphBuilder builder = PoseGraphBuilder::create(sphere_model(), {}).value();
  const Context context(1);
  PosedSegment no_normals = cap(kAbove, 0.6, Pose::Identity());
  no_normals.segment_in_scan.normals.clear();
  EXPECT_THAT(builder.insert(no_normals, context).error().message, HasSubstr("normals"));
  PosedSegment not_finite = cap(kAbove, 0.6, Pose::Identity());
  not_finite.segment_in_scan.positions[3].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(builder.insert(not_finite, context).error().message, HasSubstr("point 3 is not finite"));
  PosedSegment scaled = cap(kAbove, 0.6, Pose::Identity());
  scaled.model_from_scan.linear() *= 2.0;
  EXPECT_THAT(builder.insert(scaled, context).error().message, HasSubstr("rigid"));
  EXPECT_EQ(builder.scan_count(), 0);
  PoseGraphOptions options;
  options.voxel_ratio = 0.0;
  EXPECT_FALSE(PoseGraphBuilder::create(sphere_model(), options));
  EXPECT_FALSE(PoseGraphBuilder::create(model::PreparedModel{}, {}));
}

TEST(PoseGraph, IsAlikeWithTheSamePiecesAndAllButOneInFiftyLinks) {
  PoseGraph all;
  for (int scan = 0; scan < 11; ++scan) {
    for (int other = scan + 1; other < 11; ++other) all.edges.push_back({scan, other, 0.5});
  }
  all.components = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}};
  ASSERT_EQ(all.edges.size(), 55U);
  EXPECT_TRUE(links_alike(all, all));
  PoseGraph reversed = all;
  std::ranges::reverse(reversed.edges);
  EXPECT_TRUE(links_alike(all, reversed));
  PoseGraph fewer = all;
  fewer.edges.resize(53);  // 2 of 108 only in one
  EXPECT_TRUE(links_alike(all, fewer));
  EXPECT_TRUE(links_alike(fewer, all));
  fewer.edges.resize(52);
  EXPECT_FALSE(links_alike(all, fewer));
  PoseGraph pieces = all;
  pieces.components = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}, {10}};
  EXPECT_FALSE(links_alike(all, pieces));
}

TEST(PoseGraph, LinksThatTheCapMerelyExchangesMakeNoOtherGraph) {
  PoseGraph one;
  for (int b = 1; b < 9; ++b) one.candidates.push_back({0, b, 0.5});
  one.components = {{0, 1, 2, 3, 4, 5, 6, 7, 8}};
  PoseGraph other = one;
  one.edges.assign(one.candidates.begin(), one.candidates.begin() + 4);
  other.edges.assign(one.candidates.begin() + 4, one.candidates.end());
  EXPECT_TRUE(links_alike(one, other)) << "the same pairs to choose from";
  other.candidates = other.edges;  // now the others no longer overlap enough
  EXPECT_FALSE(links_alike(one, other));
}

}  // namespace
}  // namespace asbuilt::graph
