// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/normal_equations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "asbuilt/core/random.h"
#include "asbuilt/refine/cell_gradients.h"
#include "property/refine/bumpy_body.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kRandomPoints = 2500;  // more than are summed at a time
constexpr std::size_t kRandomEnds = 700;

PointCloud random_cloud(std::size_t count, Random& random) {
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = random.uniform(-50.0, 50.0), y = random.uniform(-50.0, 50.0), z = random.uniform(-50.0, 50.0);
    cloud.positions.push_back(Eigen::Vector3d(x, y, z).cast<float>());
    cloud.normals.push_back(test::random_direction(random).cast<float>());
  }
  return cloud;
}

// Residuals are some tens of mm: on either side of the loss' scale.
DirectedEdge randomly_matched(int source, int target, bool of_rims, Random& random) {
  DirectedEdge edge;
  edge.source = source;
  edge.target = target;
  edge.of_rims = of_rims;
  edge.scale_mm = random.uniform(30.0, 60.0);
  edge.weight = random.uniform(0.5, 2.5);
  const std::size_t count = of_rims ? kRandomEnds : kRandomPoints;
  for (std::size_t i = 0; i < count; ++i) {
    Match match;
    match.source = static_cast<std::uint32_t>(i);
    match.target = static_cast<std::uint32_t>(random.below(kRandomPoints));
    match.weight = static_cast<float>(random.uniform(0.05, 1.0));
    edge.matches.push_back(match);
  }
  return edge;
}

// Three views far from the common origin in a chain of two links; on one way of the second it is ends of faces that are
// matched.
struct MatchedAtRandom {
  explicit MatchedAtRandom(std::uint64_t seed) {
    Random random(seed, "matched at random", 0);
    Vector6d away;
    away << 0.3, -0.2, 0.5, 400.0, -250.0, 300.0;
    for (int v = 0; v < 3; ++v) {
      SampledView view;
      view.points = random_cloud(kRandomPoints, random);
      view.rims.ends = random_cloud(kRandomEnds, random);
      views.push_back(view);
      poses.push_back(pose_from_twist(away) * test::random_pose(random, 3.0, 10.0));
    }
    edges.push_back(randomly_matched(0, 1, false, random));
    edges.push_back(randomly_matched(1, 0, false, random));
    edges.push_back(randomly_matched(1, 2, true, random));
    edges.push_back(randomly_matched(2, 1, false, random));
  }

  std::vector<SampledView> views;
  std::vector<Pose> poses;
  std::vector<DirectedEdge> edges;  // two a link, there and back
  Scaling scaling{Eigen::Vector3d(403.0, -252.0, 305.0), 37.0};
};

// What one match says, in the common frame.
struct WrittenOut {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // of the source, from the scaling's origin
  Vector6d jacobian = Vector6d::Zero();
  double residual = 0.0, weight = 0.0, cost = 0.0;
};

WrittenOut written_out(const MatchedAtRandom& matched, const DirectedEdge& edge, const Match& match, bool symmetric) {
  const auto from = static_cast<std::size_t>(edge.source), to = static_cast<std::size_t>(edge.target);
  const PointCloud& source = edge.of_rims ? matched.views[from].rims.ends : matched.views[from].points;
  const PointCloud& target = matched.views[to].points;
  const Pose& theta_p = matched.poses[from];
  const Pose& theta_q = matched.poses[to];
  const Eigen::Vector3d p = theta_p * source.positions[match.source].cast<double>();
  const Eigen::Vector3d q = theta_q * target.positions[match.target].cast<double>();
  const Eigen::Vector3d normal_p = theta_p.linear() * source.normals[match.source].cast<double>();
  const Eigen::Vector3d normal_q = theta_q.linear() * target.normals[match.target].cast<double>();
  const bool takes_both_normals = symmetric && !edge.of_rims;  // the normal of an end points along its face
  const Eigen::Vector3d normal = takes_both_normals ? Eigen::Vector3d(0.5 * (normal_p + normal_q)) : normal_q;

  WrittenOut said;
  said.position = p - matched.scaling.origin;
  said.residual = normal.dot(p - q);
  // Turning p about the origin by w moves it by w x (p - origin), and its normal by w x normal_p.
  Eigen::Vector3d by_turn = said.position.cross(normal);
  if (takes_both_normals) by_turn += 0.5 * normal_p.cross(p - q);
  said.jacobian << by_turn / matched.scaling.length_mm, normal;

  const double limit = edge.scale_mm * edge.scale_mm;
  const double remaining = std::max(0.0, 1.0 - said.residual * said.residual / limit);  // Tukey's loss
  const double match_weight = edge.weight * static_cast<double>(match.weight);
  said.weight = match_weight * std::pow(remaining, 2);
  said.cost = match_weight * limit / 3.0 * (1.0 - std::pow(remaining, 3));
  return said;
}

// Positions of some 500 mm are good to 1e-13 mm, their differences of some 10 mm hold 14 digits, and sums of thousands
// still more than ten. What may cancel is held against what its terms amount to.
void expect_same_sums(const EdgeSums& actual, const EdgeSums& expected) {
  constexpr double kDigits = 1e-10;
  EXPECT_LT((actual.information - expected.information).norm(), kDigits * expected.information.norm());
  EXPECT_LT((actual.gradient - expected.gradient).norm(),
            kDigits * std::sqrt(expected.information.trace() * expected.weighted_squares));
  EXPECT_NEAR(actual.cost, expected.cost, kDigits * expected.cost);
  EXPECT_NEAR(actual.weight, expected.weight, kDigits * expected.weight);
  EXPECT_NEAR(actual.weighted_squares, expected.weighted_squares, kDigits * expected.weighted_squares);
  EXPECT_LT((actual.weighted_position - expected.weighted_position).norm(),
            kDigits * std::sqrt(expected.weight * expected.weighted_square_position));
  EXPECT_NEAR(actual.weighted_square_position, expected.weighted_square_position,
              kDigits * expected.weighted_square_position);
}

TEST(Linearise, SumsWhatTheMatchesSayInTheCommonFrame) {
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const MatchedAtRandom matched(seed);
    for (const bool symmetric : {false, true}) {
      const std::vector<EdgeSums> sums =
          linearise(matched.edges, matched.views, matched.poses, matched.scaling, symmetric, Context(2));
      ASSERT_EQ(sums.size(), matched.edges.size());
      for (std::size_t e = 0; e < sums.size(); ++e) {
        SCOPED_TRACE(testing::Message() << "seed " << seed << ", symmetric " << symmetric << ", edge " << e);
        EdgeSums expected;
        std::size_t flat = 0;  // beyond the loss' scale
        for (const Match& match : matched.edges[e].matches) {
          const WrittenOut said = written_out(matched, matched.edges[e], match, symmetric);
          expected.information += said.weight * said.jacobian * said.jacobian.transpose();
          expected.gradient += said.weight * said.residual * said.jacobian;
          expected.cost += said.cost;
          expected.weight += said.weight;
          expected.weighted_squares += said.weight * said.residual * said.residual;
          expected.weighted_position += said.weight * said.position;
          expected.weighted_square_position += said.weight * said.position.squaredNorm();
          flat += said.weight > 0.0 ? 0 : 1;
        }
        EXPECT_GT(flat, 0U) << "a test of both branches of the loss";
        EXPECT_LT(flat, matched.edges[e].matches.size()) << "a test of both branches of the loss";
        expect_same_sums(sums[e], expected);
      }
    }
  }
}

using CubePlace = std::array<int, 3>;

CubePlace cube_around(const Eigen::Vector3d& position, double cell_mm) {
  return {static_cast<int>(std::floor(position.x() / cell_mm)), static_cast<int>(std::floor(position.y() / cell_mm)),
          static_cast<int>(std::floor(position.z() / cell_mm))};
}

using CubesOfLinks = std::map<std::pair<CubePlace, std::uint32_t>, Vector6d>;

CubesOfLinks cubes_of_links(const MatchedAtRandom& matched, bool symmetric, double cell_mm) {
  CubesOfLinks cubes;
  for (std::size_t e = 0; e < matched.edges.size(); ++e) {
    const double sign = e % 2 == 0 ? 1.0 : -1.0;  // by the pose of the link's first view
    for (const Match& match : matched.edges[e].matches) {
      const WrittenOut said = written_out(matched, matched.edges[e], match, symmetric);
      if (!(said.weight > 0.0)) continue;
      const std::pair<CubePlace, std::uint32_t> place(cube_around(said.position, cell_mm),
                                                      static_cast<std::uint32_t>(e / 2));
      Vector6d& sum = cubes.try_emplace(place, Vector6d::Zero()).first->second;
      sum += sign * said.weight * said.residual * said.jacobian;
    }
  }
  return cubes;
}

// Cubes are told by what they hold, as nobody says which number is whose.
void expect_same_cubes(const std::vector<CellGradient>& cells, const CubesOfLinks& expected) {
  ASSERT_EQ(cells.size(), expected.size());
  EXPECT_TRUE(
      std::ranges::is_sorted(cells, {}, [](const CellGradient& cell) { return std::tuple(cell.cell, cell.link); }));
  double largest = 0.0;
  for (const auto& entry : expected) largest = std::max(largest, entry.second.norm());
  std::map<CubePlace, std::uint32_t> number_of;
  for (const auto& entry : expected) {
    const std::uint32_t link = entry.first.second;
    const Vector6d& gradient = entry.second;
    const auto is_it = [&](const CellGradient& cell) {
      return cell.link == link && (cell.gradient - gradient).norm() < 1e-10 * largest;
    };
    ASSERT_EQ(std::ranges::count_if(cells, is_it), 1) << "link " << link << ": " << gradient.transpose();
    const std::uint32_t number = std::ranges::find_if(cells, is_it)->cell;
    EXPECT_EQ(number_of.try_emplace(entry.first.first, number).first->second, number) << "one number for all links";
  }
  EXPECT_LT(number_of.size(), expected.size()) << "a test of cubes that both links have matches in";
  std::set<std::uint32_t> numbers;
  for (const auto& entry : number_of) numbers.insert(entry.second);
  EXPECT_EQ(numbers.size(), number_of.size()) << "a number each";
  EXPECT_EQ(*numbers.rbegin() + 1, numbers.size()) << "numbers without gaps";
}

TEST(CellGradients, AreThoseOfCubesInTheCommonFrame) {
  constexpr double kCell = 25.0;  // of some 100 mm: hundreds of cubes, and some matches in each
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    const MatchedAtRandom matched(seed);
    for (const bool symmetric : {false, true}) {
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", symmetric " << symmetric);
      expect_same_cubes(
          cell_gradients(matched.edges, matched.views, matched.poses, matched.scaling, symmetric, kCell, Context(2)),
          cubes_of_links(matched, symmetric, kCell));
    }
  }
}

}  // namespace
}  // namespace asbuilt::refine
