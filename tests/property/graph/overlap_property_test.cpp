// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "property/graph/sphere_views.h"

namespace asbuilt::graph {
namespace {

using test::cap;
using test::random_cap;
using test::sphere_model;

// Area of the part common to two spherical caps over that of the smaller, by counting on a fine lattice.
double true_overlap(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double half_a, double half_b) {
  const PointCloud lattice = test::sphere_points(200000);
  double in_a = 0, in_b = 0, both = 0;
  for (const Eigen::Vector3f& normal : lattice.normals) {
    const bool is_in_a = normal.cast<double>().dot(a) >= std::cos(half_a);
    const bool is_in_b = normal.cast<double>().dot(b) >= std::cos(half_b);
    in_a += is_in_a;
    in_b += is_in_b;
    both += is_in_a && is_in_b;
  }
  return both / std::min(in_a, in_b);
}

TEST(OverlapProperty, IsTheSharedShareOfTheSmallerCap) {
  const model::PreparedModel model = sphere_model();
  const Context context(2);
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  for (const double angle : {0.3, 0.6, 0.9, 1.2}) {
    const Eigen::Vector3d tilted(std::sin(angle), 0.0, std::cos(angle));
    const std::vector<PosedSegment> segments{cap(z, 0.8, Pose::Identity()), cap(tilted, 0.9, Pose::Identity())};
    const PoseGraph graph = build_graph(segments, model, {}, context).value();
    ASSERT_EQ(graph.overlaps.size(), 1U);
    // Visibility reaches 1.5 voxels beyond each cap (0.1 rad): the truth lies between the caps as they are and
    // the caps grown by that reach, give or take a voxel of quantisation.
    const double low = true_overlap(z, tilted, 0.8, 0.9), high = true_overlap(z, tilted, 0.9, 1.0);
    EXPECT_GT(graph.overlaps[0].overlap, std::min(low, high) - 0.05) << angle;
    EXPECT_LT(graph.overlaps[0].overlap, std::max(low, high) + 0.05) << angle;
  }
}

TEST(OverlapProperty, OnlineInAnyOrderEqualsBatch) {
  const model::PreparedModel model = sphere_model();
  const Context context(2);
  constexpr int kShuffledScans = 7;
  for (unsigned seed = 0; seed < 5; ++seed) {
    std::vector<PosedSegment> segments;
    for (int i = 0; i < kShuffledScans; ++i) {
      Random random(seed, "cap", static_cast<std::uint64_t>(i));
      segments.push_back(random_cap(random));
    }
    const PoseGraph batch = build_graph(segments, model, {}, context).value();
    std::vector<int> order(kShuffledScans);
    std::iota(order.begin(), order.end(), 0);
    std::mt19937 shuffler(seed);
    std::ranges::shuffle(order, shuffler);

    PoseGraphBuilder builder = PoseGraphBuilder::create(model, {}).value();
    for (const int scan : order) ASSERT_TRUE(builder.insert(segments[static_cast<std::size_t>(scan)], context));
    // Back to the batch's numbering, then the decision on the relabelled histogram must be the batch's.
    std::vector<PairOverlap> relabelled = builder.graph().overlaps;
    for (PairOverlap& pair : relabelled) {
      const int a = order[static_cast<std::size_t>(pair.first)], b = order[static_cast<std::size_t>(pair.second)];
      pair = {std::min(a, b), std::max(a, b), pair.overlap, pair.firmness};
    }
    std::ranges::sort(relabelled, comes_before);
    EXPECT_EQ(relabelled, batch.overlaps) << "seed " << seed;
    const EdgeSelection decision = select_edges(kShuffledScans, relabelled).value();
    EXPECT_EQ(decision.edges, batch.edges);
    EXPECT_EQ(decision.components, batch.components);
  }
}

TEST(OverlapProperty, EveryPrefixOnlineIsTheBatchOfThatPrefix) {
  const model::PreparedModel model = sphere_model();
  const Context context(2);
  std::vector<PosedSegment> segments;
  PoseGraphBuilder builder = PoseGraphBuilder::create(model, {}).value();
  for (int i = 0; i < 6; ++i) {
    Random random(11, "cap", static_cast<std::uint64_t>(i));
    segments.push_back(random_cap(random));
    ASSERT_EQ(builder.insert(segments.back(), context).value(), i);
    const PoseGraph batch = build_graph(segments, model, {}, context).value();
    const PoseGraph online = builder.graph();
    EXPECT_EQ(online.overlaps, batch.overlaps);
    EXPECT_EQ(online.edges, batch.edges);
    EXPECT_EQ(online.components, batch.components);
  }
}

TEST(OverlapProperty, ThreadsDoNotMatter) {
  const model::PreparedModel model = sphere_model();
  std::vector<PosedSegment> segments;
  for (int i = 0; i < 5; ++i) {
    Random random(3, "cap", static_cast<std::uint64_t>(i));
    segments.push_back(random_cap(random));
  }
  const PoseGraph one = build_graph(segments, model, {}, Context(1)).value();
  for (const int threads : {2, 3}) {
    const PoseGraph many = build_graph(segments, model, {}, Context(threads)).value();
    EXPECT_EQ(many.overlaps, one.overlaps) << threads;
    EXPECT_EQ(many.edges, one.edges) << threads;
  }
}

}  // namespace
}  // namespace asbuilt::graph
