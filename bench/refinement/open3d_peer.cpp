// SPDX-License-Identifier: Apache-2.0
#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/GlobalOptimization.h>
#include <open3d/pipelines/registration/GlobalOptimizationConvergenceCriteria.h>
#include <open3d/pipelines/registration/GlobalOptimizationMethod.h>
#include <open3d/pipelines/registration/PoseGraph.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/pipelines/registration/RobustKernel.h>
#include <open3d/pipelines/registration/TransformationEstimation.h>

#include "../stopwatch.h"
#include "peer.h"

namespace asbuilt::bench {
namespace {

namespace registration = open3d::pipelines::registration;

open3d::geometry::PointCloud cloud_of(const PointCloud& cloud) {
  open3d::geometry::PointCloud result;
  for (const Eigen::Vector3f& point : cloud.positions) result.points_.push_back(point.cast<double>());
  for (const Eigen::Vector3f& normal : cloud.normals) result.normals_.push_back(normal.cast<double>());
  return result;
}

std::vector<Pose> open3d_poses(const RefinementScene& scene, const std::vector<refine::View>& views,
                               const std::vector<refine::Link>& links) {
  const double diameter = scene.diameter_mm();
  const double coarse = 0.04 * diameter, fine = 0.01 * diameter;
  std::vector<open3d::geometry::PointCloud> clouds;
  for (const refine::View& view : views) clouds.push_back(cloud_of(view.segment_in_scan));
  registration::PoseGraph graph;
  for (const refine::View& view : views) graph.nodes_.emplace_back(view.model_from_scan.matrix());
  for (const refine::Link& link : links) {
    const auto source = static_cast<std::size_t>(link.first), target = static_cast<std::size_t>(link.second);
    Eigen::Matrix4d target_from_source =
        (views[target].model_from_scan.inverse() * views[source].model_from_scan).matrix();
    for (const double reach : {coarse, fine}) {
      const auto kernel =
          std::make_shared<registration::TukeyLoss>(std::max(0.25 * reach, 4.685 * scene.noise_sigma_mm));
      const registration::TransformationEstimationPointToPlane estimation(kernel);
      target_from_source =
          registration::RegistrationICP(clouds[source], clouds[target], reach, target_from_source, estimation,
                                        registration::ICPConvergenceCriteria(1e-7, 1e-7, 60))
              .transformation_;
    }
    const auto information =
        registration::GetInformationMatrixFromPointClouds(clouds[source], clouds[target], fine, target_from_source);
    graph.edges_.emplace_back(link.first, link.second, target_from_source, information, false);
  }
  registration::GlobalOptimization(graph, registration::GlobalOptimizationLevenbergMarquardt(),
                                   registration::GlobalOptimizationConvergenceCriteria(),
                                   registration::GlobalOptimizationOption(fine, 0.25, 1.0, 0));
  std::vector<Pose> poses;
  for (const auto& node : graph.nodes_) poses.push_back(orthonormalised(Pose(node.pose_)));
  return poses;
}

}  // namespace

Result<std::vector<Trial>> peer_trials(const RefinementScene& scene, int seeds, const Context& context) {
  const AccuracyJudge judge(scene);
  std::vector<Trial> trials;
  for (int seed = 0; seed < seeds; ++seed) {
    const auto views = perturbed(scene, 3.0, 0.03, static_cast<std::uint64_t>(seed));
    ASBUILT_TRY(links, product_links(scene, views, context));
    const Stopwatch their_watch;
    const std::vector<Pose> theirs = open3d_poses(scene, views, links);
    const double their_seconds = their_watch.seconds();
    const Stopwatch our_watch;
    ASBUILT_TRY(ours, refine::refine(views, links, {}, context));
    const double our_seconds = our_watch.seconds();
    Trial trial{"peer", scene.name, "Open3D multiway", static_cast<std::uint64_t>(seed), {}, {}};
    trial.figures["links"] = static_cast<double>(links.size());
    trial.figures["seconds"] = their_seconds;
    trial.figures["error_sigma"] = judge.relative_pose_error(theirs);
    trials.push_back(trial);
    trial.variant = "asbuilt";
    trial.figures["seconds"] = our_seconds;
    trial.figures["error_sigma"] = judge.relative_pose_error(ours.model_from_scan);
    trials.push_back(trial);
  }
  return trials;
}

}  // namespace asbuilt::bench
