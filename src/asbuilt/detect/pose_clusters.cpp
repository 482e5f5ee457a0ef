// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/pose_clusters.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::detect {
namespace {

// A pose as clustering sees it: rotation and the place of the model's centre in the scan.
struct Placement {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d centre_in_scan;
  double votes;
};

Placement placement(const Hypothesis& pose, const Eigen::Vector3d& centre_in_model) {
  return {Eigen::Quaterniond(pose.model_from_scan.linear()).normalized(),
          pose.model_from_scan.inverse() * centre_in_model, pose.votes};
}

class Closeness {
 public:
  explicit Closeness(const ClusterOptions& options)
      : squared_distance_(options.distance_mm * options.distance_mm), half_cosine_(std::cos(0.5 * options.angle)) {}

  // |dot| of unit quaternions is the cosine of half the angle between the rotations, whatever their signs.
  bool operator()(const Placement& a, const Placement& b) const {
    return (a.centre_in_scan - b.centre_in_scan).squaredNorm() <= squared_distance_ &&
           std::abs(a.rotation.dot(b.rotation)) >= half_cosine_;
  }

 private:
  double squared_distance_, half_cosine_;
};

// Finds the placements close to one, itself among them, by increasing index.
class Neighbourhood {
 public:
  Neighbourhood(const std::vector<Placement>& placements, const ClusterOptions& options)
      : placements_(placements),
        centres_(centres_of(placements)),
        tree_(centres_),
        are_close_(options),
        reach_mm_(static_cast<float>(kRounding * options.distance_mm)) {}

  template <class Visit>
  void for_each_close(std::size_t i, std::vector<KdTree::Neighbour>& scratch, const Visit& visit) const {
    tree_.within(centres_[i], reach_mm_, scratch);
    for (const KdTree::Neighbour& other : scratch) {
      if (are_close_(placements_[i], placements_[other.index])) visit(other.index);
    }
  }

 private:
  static constexpr double kRounding = 1.001;

  // From the first one, which keeps them exact enough for the search.
  static std::vector<Eigen::Vector3f> centres_of(const std::vector<Placement>& placements) {
    std::vector<Eigen::Vector3f> centres;
    for (const Placement& placement : placements) {
      centres.push_back((placement.centre_in_scan - placements.front().centre_in_scan).cast<float>());
    }
    return centres;
  }

  const std::vector<Placement>& placements_;
  std::vector<Eigen::Vector3f> centres_;
  KdTree tree_;
  Closeness are_close_;
  float reach_mm_;
};

Pose mean_of(std::span<const Placement> members, const Eigen::Vector3d& centre_in_model) {
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double total = 0.0;
  for (const Placement& member : members) {
    const double sign = member.rotation.dot(members.front().rotation) < 0.0 ? -1.0 : 1.0;
    rotation += sign * member.votes * member.rotation.coeffs();
    centre += member.votes * member.centre_in_scan;
    total += member.votes;
  }
  Pose mean = Pose::Identity();
  mean.linear() = Eigen::Quaterniond(rotation.normalized()).toRotationMatrix();
  mean.translation() = centre_in_model - mean.linear() * (centre / total);
  return mean;
}

}  // namespace

Pose mean_pose(std::span<const Hypothesis> poses, const Eigen::Vector3d& centre_in_model) {
  std::vector<Placement> members;
  for (const Hypothesis& pose : poses) members.push_back(placement(pose, centre_in_model));
  return mean_of(members, centre_in_model);
}

std::vector<Hypothesis> cluster_poses(std::span<const Hypothesis> poses, const Eigen::Vector3d& centre_in_model,
                                      const ClusterOptions& options, const Context& context) {
  std::vector<Placement> placements;
  for (const Hypothesis& pose : poses) placements.push_back(placement(pose, centre_in_model));
  const Neighbourhood near(placements, options);

  // Support of a pose: the votes of all within reach, so that the order of the poses does not shape the clusters. Who
  // they are is not kept: along a wall there are thousands for each.
  std::vector<double> support(placements.size());
  parallel_for_blocks(context, placements.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> scratch;
    for (std::size_t i = begin; i < end; ++i) {
      near.for_each_close(i, scratch, [&](std::uint32_t j) { support[i] += placements[j].votes; });
    }
  });
  std::vector<std::uint32_t> order(placements.size());
  std::iota(order.begin(), order.end(), 0U);
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return support[a] != support[b] ? support[a] > support[b] : a < b;
  });

  std::vector<Hypothesis> clusters;
  std::vector<std::uint8_t> is_taken(placements.size(), 0);
  std::vector<Placement> members;
  std::vector<KdTree::Neighbour> scratch;
  for (const std::uint32_t seed : order) {
    if (clusters.size() == static_cast<std::size_t>(options.most)) break;
    if (is_taken[seed] != 0) continue;
    members.assign(1, placements[seed]);
    is_taken[seed] = 1;
    near.for_each_close(seed, scratch, [&](std::uint32_t i) {
      if (is_taken[i] != 0) return;
      is_taken[i] = 1;
      members.push_back(placements[i]);
    });
    double votes = 0.0;
    for (const Placement& member : members) votes += member.votes;
    clusters.push_back({mean_of(members, centre_in_model), votes});
  }
  std::ranges::stable_sort(clusters, std::ranges::greater{}, &Hypothesis::votes);
  return clusters;
}

}  // namespace asbuilt::detect
