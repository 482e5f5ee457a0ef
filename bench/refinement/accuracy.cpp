// SPDX-License-Identifier: Apache-2.0
#include "accuracy.h"

#include <cmath>
#include <limits>
#include <numeric>

#include "asbuilt/evaluate/surface_error.h"

namespace asbuilt::bench {
namespace {

std::vector<int> all_or(std::span<const int> members, std::size_t views) {
  std::vector<int> result(members.begin(), members.end());
  if (!result.empty()) return result;
  result.resize(views);
  std::iota(result.begin(), result.end(), 0);
  return result;
}

std::vector<Eigen::Vector3d> placed(const RefinementScene& scene, std::span<const Pose> poses,
                                    const std::vector<int>& members) {
  std::vector<Eigen::Vector3d> points;
  for (const int member : members) {
    const auto v = static_cast<std::size_t>(member);
    for (const Eigen::Vector3f& point : scene.views[v].segment_in_scan.positions) {
      points.emplace_back(poses[v] * point.cast<double>());
    }
  }
  return points;
}

double after_best_motion(const std::vector<Eigen::Vector3d>& points, const Pose& towards_truth,
                         const RefinementScene& scene, const model::SurfaceDistance& surface, const Context& context) {
  double best = std::numeric_limits<double>::infinity();
  for (const Pose& start : {Pose(Pose::Identity()), towards_truth}) {
    const Pose motion =
        evaluate::best_motion_onto(points, scene.as_built, surface, scene.noise_sigma_mm, start, context);
    std::vector<Eigen::Vector3d> moved;
    for (const Eigen::Vector3d& point : points) moved.push_back(motion * point);
    best = std::min(best, evaluate::mean_surface_distance(std::span<const Eigen::Vector3d>(moved), surface, context));
  }
  return best;
}

double rms_after(const Pose& motion, const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to) {
  double squares = 0.0;
  for (std::size_t i = 0; i < from.size(); ++i) squares += (motion * from[i] - to[i]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(from.size()));
}

}  // namespace

AccuracyJudge::AccuracyJudge(const RefinementScene& scene) : scene_(scene), surface_(scene.as_built) {}

double AccuracyJudge::difference(std::span<const Pose> a, std::span<const Pose> b, std::span<const int> members) const {
  const std::vector<int> chosen = all_or(members, scene_.views.size());
  const auto from = placed(scene_, a, chosen), to = placed(scene_, b, chosen);
  return rms_after(best_rigid_motion(from, to), from, to) / scene_.noise_sigma_mm;
}

double AccuracyJudge::relative_pose_error(std::span<const Pose> ours, std::span<const int> members) const {
  return difference(ours, scene_.truth, members);
}

double AccuracyJudge::error_of_fits_to_truth(const Context& context) const {
  std::vector<Pose> fitted;
  for (std::size_t v = 0; v < scene_.views.size(); ++v) {
    const auto points = placed(scene_, scene_.truth, {static_cast<int>(v)});
    const Pose motion =
        evaluate::best_motion_onto(points, scene_.as_built, surface_, scene_.noise_sigma_mm, Pose::Identity(), context);
    fitted.push_back(motion * scene_.truth[v]);
  }
  return relative_pose_error(fitted);
}

Accuracy AccuracyJudge::judge(std::span<const Pose> ours, const Context& context, std::span<const int> members) const {
  const std::vector<int> chosen = all_or(members, scene_.views.size());
  const auto mine = placed(scene_, ours, chosen), truth = placed(scene_, scene_.truth, chosen);
  const Pose true_from_ours = best_rigid_motion(mine, truth);
  Accuracy accuracy;
  accuracy.relative_pose_error_sigma = rms_after(true_from_ours, mine, truth) / scene_.noise_sigma_mm;
  accuracy.mean_distance_mm = after_best_motion(mine, true_from_ours, scene_, surface_, context);
  accuracy.oracle_distance_mm = after_best_motion(truth, Pose::Identity(), scene_, surface_, context);
  return accuracy;
}

}  // namespace asbuilt::bench
