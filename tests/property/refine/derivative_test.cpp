// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <functional>

#include "asbuilt/core/robust.h"
#include "asbuilt/refine/normal_equations.h"
#include "asbuilt/refine/point_to_plane.h"
#include "property/refine/bumpy_body.h"

namespace asbuilt::refine {
namespace {

Eigen::Vector3d random_point(Random& random) {
  return {random.uniform(-50, 50), random.uniform(-50, 50), random.uniform(-50, 50)};
}

// Central differences of f(twist) at zero.
Vector6d central_differences(const std::function<double(const Pose&)>& f) {
  Vector6d gradient;
  for (int i = 0; i < 6; ++i) {
    Vector6d step = Vector6d::Zero();
    step[i] = 1e-6;
    gradient[i] = (f(pose_from_twist(step)) - f(pose_from_twist(-step))) / 2e-6;
  }
  return gradient;
}

struct Pair {
  Pose theta_p, theta_q;
  Eigen::Vector3d p, q, normal_p, normal_q;  // in their scan frames
};

Pair random_pair(std::uint64_t index) {
  Random random(1, "pair", index);
  return {test::random_pose(random, 3.0, 50.0),
          test::random_pose(random, 3.0, 50.0),
          random_point(random),
          random_point(random),
          test::random_direction(random),
          test::random_direction(random)};
}

TEST(PointToPlane, IsEquationFourInTheFrameOfTheTarget) {
  for (std::uint64_t i = 0; i < 50; ++i) {
    const Pair pair = random_pair(i);
    const double by_definition = ((pair.theta_q.inverse() * pair.theta_p) * pair.p - pair.q).dot(pair.normal_q);
    const double ours =
        point_to_plane(pair.theta_p * pair.p, pair.theta_q * pair.q, pair.theta_q.linear() * pair.normal_q).residual;
    EXPECT_NEAR(ours, by_definition, 1e-10);
  }
}

TEST(PointToPlane, JacobiansOfBothPosesMatchCentralDifferences) {
  for (std::uint64_t i = 0; i < 50; ++i) {
    const Pair pair = random_pair(i);
    const auto residual = [&](const Pose& theta_p, const Pose& theta_q) {
      return point_to_plane(theta_p * pair.p, theta_q * pair.q, theta_q.linear() * pair.normal_q);
    };
    const Vector6d analytic = residual(pair.theta_p, pair.theta_q).jacobian;
    const Vector6d by_p =
        central_differences([&](const Pose& twist) { return residual(twist * pair.theta_p, pair.theta_q).residual; });
    const Vector6d by_q =
        central_differences([&](const Pose& twist) { return residual(pair.theta_p, twist * pair.theta_q).residual; });
    // Values of some 100 mm at a step of 1e-6 leave 1e-8 of rounding over 2e-6.
    EXPECT_LT((by_p - analytic).cwiseAbs().maxCoeff(), 1e-6 * 100.0) << i;
    EXPECT_LT((by_q + analytic).cwiseAbs().maxCoeff(), 1e-6 * 100.0) << i;
  }
}

TEST(SymmetricPointToPlane, JacobiansOfBothPosesMatchCentralDifferences) {
  for (std::uint64_t i = 0; i < 50; ++i) {
    const Pair pair = random_pair(i);
    const auto residual = [&](const Pose& theta_p, const Pose& theta_q) {
      return symmetric_point_to_plane(theta_p * pair.p, theta_p.linear() * pair.normal_p, theta_q * pair.q,
                                      theta_q.linear() * pair.normal_q);
    };
    const Vector6d analytic = residual(pair.theta_p, pair.theta_q).jacobian;
    const Vector6d by_p =
        central_differences([&](const Pose& twist) { return residual(twist * pair.theta_p, pair.theta_q).residual; });
    const Vector6d by_q =
        central_differences([&](const Pose& twist) { return residual(pair.theta_p, twist * pair.theta_q).residual; });
    EXPECT_LT((by_p - analytic).cwiseAbs().maxCoeff(), 1e-4) << i;
    EXPECT_LT((by_q + analytic).cwiseAbs().maxCoeff(), 1e-4) << i;
  }
}

TEST(SymmetricPointToPlane, IsBlindToTheCurvatureOfACircle) {
  for (const double angle : {0.1, 0.5, 1.0}) {
    const Eigen::Vector3d n_p(1, 0, 0), n_q(std::cos(angle), std::sin(angle), 0);
    EXPECT_NEAR(symmetric_point_to_plane(10.0 * n_p, n_p, 10.0 * n_q, n_q).residual, 0.0, 1e-12);
    EXPECT_GT(std::abs(point_to_plane(10.0 * n_p, 10.0 * n_q, n_q).residual), 0.01);
  }
}

// Two views of a few random points, so that residuals fall on either side of the loss' scale.
struct SmallProblem {
  std::vector<SampledView> views;
  std::vector<DirectedEdge> edges;
  std::vector<Pose> poses;
};

SmallProblem small_problem(double loss_scale) {
  SmallProblem problem;
  Random random(7, "small problem", 0);
  for (int v = 0; v < 2; ++v) {
    PointCloud cloud;
    for (int i = 0; i < 40; ++i) {
      cloud.positions.push_back(random_point(random).cast<float>());
      cloud.normals.push_back(test::random_direction(random).cast<float>());
    }
    problem.views.push_back(sampled_view(cloud, 0.0, {1000, 1000, false, false}, Context(1)));
    problem.poses.push_back(test::random_pose(random, 1.0, 10.0));
  }
  DirectedEdge edge;
  edge.source = 0;
  edge.target = 1;
  edge.scale_mm = loss_scale;
  edge.weight = 2.5;
  for (std::uint32_t i = 0; i < 40; ++i) edge.matches.push_back({i, 39 - i});
  problem.edges.push_back(edge);
  return problem;
}

TEST(Linearise, GradientIsThatOfTheCostOnEitherBranchOfTheLoss) {
  const Context context(1);
  // Residuals are some tens of mm: all within 500 mm, all beyond 0.01 mm, and both kinds at 40 mm.
  for (const double scale : {500.0, 40.0, 0.01}) {
    for (const bool symmetric : {false, true}) {
      const SmallProblem problem = small_problem(scale);
      const Scaling scaling{Eigen::Vector3d(3, -2, 5), 20.0};
      const EdgeSums sums = linearise(problem.edges, problem.views, problem.poses, scaling, symmetric, context).front();
      const auto cost = [&](std::size_t view) {
        return [&, view](const Pose& twist) {
          std::vector<Pose> poses = problem.poses;
          poses[view] = twist * poses[view];
          return total_cost(problem.edges, problem.views, poses, symmetric, context);
        };
      };
      EXPECT_NEAR(sums.cost, cost(0)(Pose::Identity()), 1e-6 * sums.cost);
      // d cost = 2 w r dr: the stored gradient is half of the cost's. From scaled to plain twists by the chain rule.
      const Matrix6d scaled_from_twist = scaling.twist_from_scaled().inverse();
      const Vector6d gradient = 2.0 * scaled_from_twist.transpose() * sums.gradient;
      const double size = 1.0 + gradient.norm();
      EXPECT_LT((central_differences(cost(0)) - gradient).norm(), 1e-4 * size) << scale << " " << symmetric;
      EXPECT_LT((central_differences(cost(1)) + gradient).norm(), 1e-4 * size) << scale << " " << symmetric;
      if (scale == 0.01) {
        EXPECT_EQ(gradient.norm(), 0.0) << "beyond its scale the Tukey loss has no pull";
      }
    }
  }
}

template <class Loss>
void expect_weight_is_derivative(const Loss& loss) {
  for (const double squared : {0.01, 0.5, 0.9, 1.1, 4.0, 30.0}) {  // below and above the scale of 1
    const double h = 1e-6;
    EXPECT_NEAR(loss.weight(squared), (loss.value(squared + h) - loss.value(squared - h)) / (2 * h), 1e-6) << squared;
  }
}

TEST(RobustLoss, WeightIsTheDerivativeOnBothBranches) {
  expect_weight_is_derivative(TukeyLoss{1.0});
  expect_weight_is_derivative(HuberLoss{1.0});
  expect_weight_is_derivative(CauchyLoss{1.0});
}

}  // namespace
}  // namespace asbuilt::refine
