// SPDX-License-Identifier: Apache-2.0
#include "self_match.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/simulate/mesh_edit.h"
#include "asbuilt/simulate/resting.h"

namespace asbuilt::bench {
namespace {

constexpr std::size_t kRotations = 6000;  // neighbours some 15 degrees apart
constexpr std::size_t kCoarseSamples = 120, kFineSamples = 1500, kRegistered = 120;
constexpr int kIterations = 40;
constexpr double kOff = 0.01;  // of the diameter
constexpr double kSmallestTurn = 15.0, kSameDeg = 5.0;

using Points = std::vector<Eigen::Vector3d>;

Points surface_points(const TriangleMesh& mesh, std::size_t count) {
  Points points;
  for (const auto& sample : simulate::area_samples(mesh, count, Random(1, "self match", 0))) {
    points.push_back(sample.position);
  }
  return points;
}

Eigen::Vector3d mean_of(const Points& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

Pose turned_about(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = to - rotation * from;
  return pose;
}

double mean_distance(const Pose& motion, const Points& points, const model::SurfaceDistance& surface) {
  double sum = 0.0;
  for (const Eigen::Vector3d& point : points) sum += std::abs(surface.nearest(motion * point).signed_distance);
  return sum / static_cast<double>(points.size());
}

Pose registered(Pose motion, const Points& points, const model::SurfaceDistance& surface) {
  for (int i = 0; i < kIterations; ++i) {
    Points nearest;
    for (const Eigen::Vector3d& point : points) nearest.push_back(surface.nearest(motion * point).point);
    motion = best_rigid_motion(points, nearest);
  }
  return motion;
}

double off_share(const Pose& motion, const Points& points, const model::SurfaceDistance& surface, double reach) {
  const auto off = std::ranges::count_if(points, [&](const Eigen::Vector3d& point) {
    return std::abs(surface.nearest(motion * point).signed_distance) > reach;
  });
  return static_cast<double>(off) / static_cast<double>(points.size());
}

double degrees(const Eigen::Matrix3d& rotation) { return rotation_angle(rotation) * 180.0 / std::numbers::pi; }

}  // namespace

std::vector<SelfMatch> self_matches(const TriangleMesh& mesh, bool mirrored, std::size_t most, const Context& context) {
  const model::SurfaceDistance surface(mesh);
  const TriangleMesh image = mirrored ? simulate::scaled(mesh, {-1.0, 1.0, 1.0}) : mesh;
  const Points coarse = surface_points(image, kCoarseSamples), fine = surface_points(image, kFineSamples);
  const Eigen::Vector3d from = mean_of(fine), to = mean_of(surface_points(mesh, kFineSamples));

  struct Start {
    double distance = 0.0;
    Pose motion = Pose::Identity();
  };
  std::vector<Start> starts(kRotations);
  parallel_for(context, starts.size(), 64, [&](std::size_t i) {
    Random random(2, "self match", i);
    const Pose motion = turned_about(simulate::random_rotation(random), from, to);
    starts[i] = {mean_distance(motion, coarse, surface), motion};
  });
  const auto is_trivial = [&](const Pose& motion) { return !mirrored && degrees(motion.linear()) < kSmallestTurn; };
  std::erase_if(starts, [&](const Start& start) { return is_trivial(start.motion); });
  std::ranges::stable_sort(starts, {}, &Start::distance);
  starts.resize(std::min(starts.size(), kRegistered));

  std::vector<SelfMatch> found(starts.size());
  parallel_for(context, found.size(), 1, [&](std::size_t i) {
    const Pose motion = registered(starts[i].motion, fine, surface);
    found[i] = {motion, degrees(motion.linear()), off_share(motion, fine, surface, kOff * diameter(mesh))};
  });
  std::ranges::stable_sort(found, {}, &SelfMatch::off_share);
  std::vector<SelfMatch> different;
  for (const SelfMatch& match : found) {
    if (different.size() == most) break;
    const bool known = is_trivial(match.motion) || std::ranges::any_of(different, [&](const SelfMatch& other) {
                         return degrees(other.motion.linear().transpose() * match.motion.linear()) < kSameDeg;
                       });
    if (!known) different.push_back(match);
  }
  return different;
}

}  // namespace asbuilt::bench
