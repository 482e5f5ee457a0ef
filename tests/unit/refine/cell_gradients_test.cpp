// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/cell_gradients.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <set>
#include <utility>
#include <vector>

#include "property/refine/bumpy_body.h"

namespace asbuilt::refine {
namespace {

/// Views at their starting poses, matched over all links.
struct Matched {
  explicit Matched(std::uint64_t seed) : scene(test::bumpy_scene({}, seed)) {
    for (const View& view : scene.views) {
      views.push_back(sampled_view(view.segment_in_scan, view.noise_sigma_mm, {}, Context(2)));
      poses.push_back(view.model_from_scan);
    }
    for (const Link& link : scene.links) {
      for (const auto& [from, to] : {std::pair(link.first, link.second), std::pair(link.second, link.first)}) {
        DirectedEdge edge;
        edge.source = from, edge.target = to;
        edge.reach_mm = 4.0, edge.scale_mm = 3.0, edge.weight = 0.7;
        edges.push_back(edge);
      }
    }
    find_matches(edges, views, poses, {false, true, 0.7, true, 0.0}, Context(2));
  }

  test::Scene scene;
  std::vector<SampledView> views;
  std::vector<Pose> poses;
  std::vector<DirectedEdge> edges;
  Scaling scaling{Eigen::Vector3d(1, -2, 3), 45.0};
};

TEST(CellGradients, AddUpToTheGradientOfEachLink) {
  const Matched matched(3);
  const auto sums = linearise(matched.edges, matched.views, matched.poses, matched.scaling, false, Context(2));
  const auto cells =
      cell_gradients(matched.edges, matched.views, matched.poses, matched.scaling, false, 20.0, Context(2));
  std::vector<Vector6d> of_link(matched.scene.links.size(), Vector6d::Zero());
  std::set<std::uint32_t> numbers;
  for (const CellGradient& cell : cells) {
    of_link[cell.link] += cell.gradient;
    numbers.insert(cell.cell);
  }
  EXPECT_GT(numbers.size(), 20U) << "a body of 100 mm in cubes of 20";
  EXPECT_EQ(*numbers.rbegin() + 1, numbers.size()) << "numbers without gaps";
  for (std::size_t l = 0; l < of_link.size(); ++l) {
    const Vector6d whole = sums[2 * l].gradient - sums[2 * l + 1].gradient;
    EXPECT_LT((of_link[l] - whole).norm(), 1e-9 * (1.0 + whole.norm())) << "link " << l;
  }
}

TEST(CellGradients, AreTheSameOnOneAndOnThreeThreads) {
  const Matched matched(4);
  const auto with = [&](int threads) {
    return cell_gradients(matched.edges, matched.views, matched.poses, matched.scaling, false, 15.0, Context(threads));
  };
  const auto one = with(1), three = with(3);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].cell, three[i].cell);
    EXPECT_EQ(one[i].link, three[i].link);
    EXPECT_EQ(one[i].gradient, three[i].gradient);
  }
}

// H^-1 (sum g g^T) H^-1, written out.
TEST(NormalEquations, StrewnBlocksAreThoseOfTheDenseFormula) {
  constexpr int kViews = 4, kFixed = 1;
  constexpr std::uint32_t kCells = 300;  // more than are solved for at a time
  Random random(7, "strewn", 0);
  std::vector<LinkBlock> links;
  for (const auto& [first, second] : {std::pair(0, 1), std::pair(1, 2), std::pair(2, 3), std::pair(0, 3)}) {
    LinkBlock link;
    link.first = first, link.second = second;
    const Matrix6d root = Matrix6d::NullaryExpr([&] { return random.normal(); });
    link.information = root * root.transpose() + Matrix6d::Identity();
    links.push_back(link);
  }
  const auto row_of = [](int view) { return view == kFixed ? -1 : 6 * (view < kFixed ? view : view - 1); };
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(6 * (kViews - 1), 6 * (kViews - 1));
  for (const LinkBlock& link : links) {
    const int a = row_of(link.first), b = row_of(link.second);
    if (a >= 0) information.block<6, 6>(a, a) += link.information;
    if (b >= 0) information.block<6, 6>(b, b) += link.information;
    if (a < 0 || b < 0) continue;
    information.block<6, 6>(a, b) -= link.information;
    information.block<6, 6>(b, a) -= link.information;
  }
  std::vector<CellGradient> cells;
  Eigen::MatrixXd gradients = Eigen::MatrixXd::Zero(information.rows(), kCells);
  for (std::uint32_t c = 0; c < kCells; ++c) {
    for (std::uint32_t l = c % 2; l < links.size(); l += 2) {
      const Vector6d gradient = Vector6d::NullaryExpr([&] { return random.normal(); });
      cells.push_back({c, l, gradient});
      const int a = row_of(links[l].first), b = row_of(links[l].second);
      if (a >= 0) gradients.col(c).segment<6>(a) += gradient;
      if (b >= 0) gradients.col(c).segment<6>(b) -= gradient;
    }
  }
  const Eigen::MatrixXd responses = information.inverse() * gradients;
  const Eigen::MatrixXd expected = responses * responses.transpose();
  const auto blocks = NormalEquations(kViews, kFixed, links).strewn_blocks(cells);
  for (int view = 0; view < kViews; ++view) {
    const Matrix6d& block = blocks[static_cast<std::size_t>(view)];
    if (view == kFixed) {
      EXPECT_EQ(block, Matrix6d::Zero());
    } else {
      EXPECT_LT((block - expected.block<6, 6>(row_of(view), row_of(view))).norm(), 1e-6 * block.norm()) << view;
    }
  }
}

}  // namespace
}  // namespace asbuilt::refine
