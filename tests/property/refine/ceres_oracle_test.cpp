// SPDX-License-Identifier: Apache-2.0
// Our joint Levenberg-Marquardt against a general solver, on the same fixed correspondences and the same loss.
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gmock/gmock.h>

#include "asbuilt/refine/correspondences.h"
#include "asbuilt/refine/normal_equations.h"
#include "property/refine/bumpy_body.h"

namespace asbuilt::refine {
namespace {

// rho of TukeyLoss in Ceres' form: rho, rho', rho''.
class CeresTukey : public ceres::LossFunction {
 public:
  explicit CeresTukey(double scale) : scale_(scale) {}
  void Evaluate(double squared, double out[3]) const override {
    const double limit = scale_ * scale_, left = 1.0 - squared / limit;
    out[0] = squared < limit ? limit / 3.0 * (1.0 - left * left * left) : limit / 3.0;
    out[1] = squared < limit ? left * left : 0.0;
    out[2] = squared < limit ? -2.0 * left / limit : 0.0;
  }

 private:
  double scale_;
};

// Eq. 4 with poses as axis-angle and translation of x -> R x + t, differentiated by Ceres.
struct PointToPlaneCost {
  Eigen::Vector3d p, q, normal;

  template <class T>
  bool operator()(const T* const pose_p, const T* const pose_q, T* residual) const {
    const auto transformed = [](const T* pose, const Eigen::Vector3d& x, bool translate) {
      const T point[3] = {T(x.x()), T(x.y()), T(x.z())};
      T rotated[3];
      ceres::AngleAxisRotatePoint(pose, point, rotated);
      Eigen::Matrix<T, 3, 1> result(rotated[0], rotated[1], rotated[2]);
      if (translate) result += Eigen::Matrix<T, 3, 1>(pose[3], pose[4], pose[5]);
      return result;
    };
    residual[0] = transformed(pose_q, normal, false).dot(transformed(pose_p, p, true) - transformed(pose_q, q, true));
    return true;
  }
};

using PoseParameters = std::array<double, 6>;

PoseParameters parameters_of(const Pose& pose) {
  PoseParameters parameters;
  const Eigen::Matrix3d rotation = pose.linear();
  ceres::RotationMatrixToAngleAxis(ceres::ColumnMajorAdapter3x3(rotation.data()), parameters.data());
  for (int i = 0; i < 3; ++i) parameters[static_cast<std::size_t>(3 + i)] = pose.translation()[i];
  return parameters;
}

Pose pose_of(const PoseParameters& parameters) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_from_axis_angle({parameters[0], parameters[1], parameters[2]});
  pose.translation() = Eigen::Vector3d(parameters[3], parameters[4], parameters[5]);
  return pose;
}

struct Problem {
  std::vector<SampledView> views;
  std::vector<DirectedEdge> edges;
  std::vector<Pose> poses;
  std::vector<Link> links;
};

Problem with_fixed_matches(const test::Scene& scene, double loss_scale) {
  Problem problem;
  problem.links = scene.links;
  const Context context(2);
  for (const View& view : scene.views) {
    problem.views.push_back(sampled_view(view.segment_in_scan, 0.0, {.points = 600, .coarse_points = 600}, context));
    problem.poses.push_back(view.model_from_scan);
  }
  for (const Link& link : scene.links) {
    for (const auto& [from, to] : {std::pair(link.first, link.second), std::pair(link.second, link.first)}) {
      DirectedEdge edge;
      edge.source = from;
      edge.target = to;
      edge.reach_mm = 6.0;
      edge.scale_mm = loss_scale;
      problem.edges.push_back(edge);
    }
  }
  find_matches(problem.edges, problem.views, problem.poses, {false, true, 0.7}, context);
  return problem;
}

std::vector<Pose> solved_by_ceres(const Problem& problem, int fixed) {
  std::vector<PoseParameters> parameters;
  for (const Pose& pose : problem.poses) parameters.push_back(parameters_of(pose));
  ceres::Problem ceres_problem;
  for (const DirectedEdge& edge : problem.edges) {
    const auto source = static_cast<std::size_t>(edge.source), target = static_cast<std::size_t>(edge.target);
    for (const Match& match : edge.matches) {
      auto* cost = new ceres::AutoDiffCostFunction<PointToPlaneCost, 1, 6, 6>(
          new PointToPlaneCost{problem.views[source].points.positions[match.source].cast<double>(),
                               problem.views[target].points.positions[match.target].cast<double>(),
                               problem.views[target].points.normals[match.target].cast<double>()});
      ceres_problem.AddResidualBlock(cost,
                                     new ceres::ScaledLoss(new CeresTukey(edge.scale_mm),
                                                           static_cast<double>(match.weight), ceres::TAKE_OWNERSHIP),
                                     parameters[source].data(), parameters[target].data());
    }
  }
  ceres_problem.SetParameterBlockConstant(parameters[static_cast<std::size_t>(fixed)].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-14;
  options.max_num_iterations = 200;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  std::vector<Pose> poses;
  for (const PoseParameters& pose : parameters) poses.push_back(pose_of(pose));
  return poses;
}

// The same minimum by our own linearisation, normal equations and update.
std::vector<Pose> solved_by_us(const Problem& problem, int fixed) {
  const Context context(2);
  const Scaling scaling{Eigen::Vector3d::Zero(), 50.0};
  std::vector<Pose> poses = problem.poses;
  for (int iteration = 0; iteration < 100; ++iteration) {
    const std::vector<EdgeSums> sums = linearise(problem.edges, problem.views, poses, scaling, false, context);
    std::vector<LinkBlock> blocks;
    for (std::size_t l = 0; l < problem.links.size(); ++l) {
      const EdgeSums &there = sums[2 * l], &back = sums[2 * l + 1];
      blocks.push_back({problem.links[l].first, problem.links[l].second, there.information + back.information,
                        there.gradient - back.gradient, there.weight + back.weight});
    }
    const NormalEquations equations(static_cast<int>(poses.size()), fixed, blocks);
    const std::vector<Vector6d> step = equations.step(1e-9, false);
    for (std::size_t v = 0; v < poses.size(); ++v) {
      poses[v] = orthonormalised(pose_from_twist(scaling.twist_from_scaled() * step[v]) * poses[v]);
    }
  }
  return poses;
}

TEST(CeresOracle, JointMinimumOnFixedCorrespondencesIsTheSame) {
  for (const double loss_scale : {1000.0, 1.5}) {  // plain least squares, and a loss that leaves some matches out
    for (std::uint64_t seed = 0; seed < 2; ++seed) {
      test::SceneOptions options;
      options.points = 2500;
      options.start_error = 0.6;
      const Problem problem = with_fixed_matches(test::bumpy_scene(options, seed), loss_scale);
      const int fixed = 1;
      const std::vector<Pose> theirs = solved_by_ceres(problem, fixed), ours = solved_by_us(problem, fixed);
      const Context context(1);
      const double cost_theirs = total_cost(problem.edges, problem.views, theirs, false, context);
      const double cost_ours = total_cost(problem.edges, problem.views, ours, false, context);
      const double cost_start = total_cost(problem.edges, problem.views, problem.poses, false, context);
      EXPECT_LT(cost_ours, 0.9 * cost_start);
      EXPECT_NEAR(cost_ours, cost_theirs, 1e-8 * cost_theirs);
      for (std::size_t v = 0; v < ours.size(); ++v) {
        const Pose difference = ours[v].inverse() * theirs[v];
        EXPECT_LT(difference.translation().norm(), 1e-4) << "view " << v << ", mm, of a part 100 mm wide";
        EXPECT_LT(rotation_angle(difference.linear()), 1e-6) << "view " << v;
      }
    }
  }
}

TEST(CeresOracle, SparseAndDenseFactorisationsAgree) {
  // A ring of 130 views (774 unknowns: sparse) whose blocks are random but exactly solvable: the residuals vanish at a
  // known step, so the solution is known without a second solver.
  constexpr int kViews = 130;
  std::vector<Vector6d> truth(kViews, Vector6d::Zero());
  Random random(5, "ring", 0);
  for (int v = 1; v < kViews; ++v) {
    for (int i = 0; i < 6; ++i) truth[static_cast<std::size_t>(v)][i] = random.normal();
  }
  std::vector<LinkBlock> links;
  for (int v = 0; v < kViews; ++v) {
    LinkBlock link{v, (v + 1) % kViews, Matrix6d::Zero(), Vector6d::Zero(), 1.0};
    for (int row = 0; row < 20; ++row) {
      Vector6d jacobian;
      for (int i = 0; i < 6; ++i) jacobian[i] = random.normal();
      const double residual =
          -jacobian.dot(truth[static_cast<std::size_t>(link.first)] - truth[static_cast<std::size_t>(link.second)]);
      link.information += jacobian * jacobian.transpose();
      link.gradient += jacobian * residual;
    }
    links.push_back(link);
  }
  const std::vector<Vector6d> step = NormalEquations(kViews, 0, links).step(0.0, false);
  ASSERT_EQ(step.size(), truth.size());
  for (std::size_t v = 0; v < truth.size(); ++v) EXPECT_LT((step[v] - truth[v]).norm(), 1e-6) << v;
}

}  // namespace
}  // namespace asbuilt::refine
