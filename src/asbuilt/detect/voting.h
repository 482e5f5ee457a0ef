// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/detect/options.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::detect {

/// A maximum of one voting space V_r (Eq. 10).
struct Peak {
  std::uint32_t model_sample = 0;
  float alpha = 0.0F;  ///< radians
  float votes = 0.0F;
};

/// What the scene lends to voting: even oriented samples and where they were seen from.
struct Scene {
  PointCloud samples;
  scan::Viewpoint viewpoint;
  bool normals_oriented = true;
};

/// The voting space of one reference point at a time; keeps its memory between calls.
class LocalVoting {
 public:
  LocalVoting(const Codebook& codebook, const Scene& scene, const DetectOptions& options);

  /// Pairs the reference sample (its normal turned by `sign`) with all samples within reach and gives the maxima of
  /// V(m, alpha) = sum_i p(m, alpha | s_r, s_i) (Eq. 7-10), best first.
  [[nodiscard]] std::vector<Peak> vote(std::uint32_t reference, float sign);

  [[nodiscard]] std::uint64_t votes_cast() const { return cast_; }  ///< since it was made

 private:
  void add_pair(const Eigen::Vector3f& reference, const Eigen::Vector3f& reference_normal, const Eigen::Vector3f& other,
                const Eigen::Vector3f& other_normal, float scene_angle);
  void add_votes(std::span<const Codebook::Entry> entries, std::uint16_t angle, float weight);
  [[nodiscard]] std::vector<Peak> peaks(const Pose& scene_frame, const Eigen::Vector3f& reference) const;

  const Codebook& codebook_;
  const Scene& scene_;
  DetectOptions options_;     // a copy: callers pass temporaries
  unsigned row_shift_;        // rows are a power of two apart, which spares a multiplication a vote
  std::vector<float> votes_;  // [model sample][alpha bin]
  std::uint64_t cast_ = 0;
};

}  // namespace asbuilt::detect
