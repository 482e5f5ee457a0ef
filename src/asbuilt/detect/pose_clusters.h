// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"

namespace asbuilt::detect {

/// A candidate pose with the votes of the cluster it stands for.
struct Hypothesis {
  Pose model_from_scan = Pose::Identity();
  double votes = 0.0;
};

struct ClusterOptions {
  double angle = 0.2;        ///< radians
  double distance_mm = 1.0;  ///< at the model's centre
  int most = 200;            ///< clusters given back
};

/// Groups poses that agree in rotation and in where they put `centre_in_model`, and averages each group in SE(3),
/// weighted by votes: rotations as sign-aligned unit quaternions, positions at the centre. Sorted by decreasing votes
/// of the group; ties end with the index of the strongest member. Symmetric: which pose asks does not matter.
[[nodiscard]] std::vector<Hypothesis> cluster_poses(std::span<const Hypothesis> poses,
                                                    const Eigen::Vector3d& centre_in_model,
                                                    const ClusterOptions& options, const Context& context);

/// Weighted mean of poses around one of them; see cluster_poses.
[[nodiscard]] Pose mean_pose(std::span<const Hypothesis> poses, const Eigen::Vector3d& centre_in_model);

}  // namespace asbuilt::detect
