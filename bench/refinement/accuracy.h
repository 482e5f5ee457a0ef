// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "scene.h"

namespace asbuilt::bench {

/// How far refined poses are from the true ones (docs/architecture.md, "Right and wrong").
struct Accuracy {
  double relative_pose_error_sigma = 0.0;  ///< RMS over the part's points after one common motion, in units of noise
  double mean_distance_mm = 0.0;           ///< of the part's points to the true surface, after one common motion
  double oracle_distance_mm = 0.0;         ///< the same under the true poses
  [[nodiscard]] double ratio_to_oracle() const { return mean_distance_mm / oracle_distance_mm; }
};

/// Judges poses of (some of) a scene's views.
class AccuracyJudge {
 public:
  explicit AccuracyJudge(const RefinementScene& scene);

  /// Relative pose error in sigma over the views in `members` (all if empty), whose poses are `ours`.
  [[nodiscard]] double relative_pose_error(std::span<const Pose> ours, std::span<const int> members = {}) const;
  [[nodiscard]] Accuracy judge(std::span<const Pose> ours, const Context& context,
                               std::span<const int> members = {}) const;

  /// The same of views fitted one by one to the true as-built surface, which nobody has, from their true poses on: what
  /// the points that each scan gives can tell of its pose at best.
  [[nodiscard]] double error_of_fits_to_truth(const Context& context) const;

  /// The same between two sets of poses: how far one run ends from another, in sigma.
  [[nodiscard]] double difference(std::span<const Pose> a, std::span<const Pose> b,
                                  std::span<const int> members = {}) const;

 private:
  const RefinementScene& scene_;
  model::SurfaceDistance surface_;
};

}  // namespace asbuilt::bench
