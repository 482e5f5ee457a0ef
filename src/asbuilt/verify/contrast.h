// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>
#include <memory>

#include "asbuilt/core/pose.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/verify/evidence.h"

namespace asbuilt::verify {

/// Where a part stands, and of which size: the part itself, or a copy of it scaled about a point of the model that
/// stays where the pose puts it.
struct SizedPose {
  SizedPose(const Pose& pose) : model_from_scan(pose) {}  // NOLINT(google-explicit-constructor): size as designed
  SizedPose(const Pose& pose, double the_size, const Eigen::Vector3d& the_fixed_point)
      : model_from_scan(pose), size(the_size), fixed_in_model(the_fixed_point) {}

  [[nodiscard]] Eigen::Vector3d in_model(const Eigen::Vector3d& in_scan) const {
    return fixed_in_model + (model_from_scan * in_scan - fixed_in_model) / size;
  }
  [[nodiscard]] Eigen::Affine3d scan_from_model() const {
    return model_from_scan.inverse() * Eigen::Translation3d(fixed_in_model) * Eigen::Scaling(size) *
           Eigen::Translation3d(-fixed_in_model);
  }

  Pose model_from_scan;
  double size = 1.0;
  Eigen::Vector3d fixed_in_model = Eigen::Vector3d::Zero();
};

/// What the scan says where two poses of the part predict different things, in measurements that count singly.
struct PoseContrast {
  double for_first = 0.0, for_second = 0.0;

  [[nodiscard]] double total() const { return for_first + for_second; }
};

/// What one of the model's dense samples counts for: samples closer than the scan's points, `spacing_mm` apart, are not
/// independent.
[[nodiscard]] double measurements_per_sample(const model::PreparedModel& model, double spacing_mm);

/// Compares two placements by the samples of the model that only one of them puts where they are: a hole that one
/// claims and the other does not. Everything that both predict says nothing about which is right, and would drown the
/// rest.
///
/// Such a sample speaks for its pose if the nearest scan point lies on the model at this pose and clearly less so at
/// the other; against it, if the sensor measured something else there. What is hidden or averted is not asked.
/// Symmetric in the two poses. At most `most_samples` of the options are asked. Cost: two lookups a sample, and a
/// search and a ray for those that differ.
[[nodiscard]] PoseContrast contrast(const SizedPose& first, const SizedPose& second, const model::PreparedModel& model,
                                    const ScanEvidence& scan, const EvidenceOptions& options);

/// The same for one placement and many rivals, quicker: what the scan says where the placement puts its samples is asked
/// once. Everything that it is made of must outlive it. Not for two threads at once.
class ContrastOf {
 public:
  ContrastOf(const SizedPose& own, const model::PreparedModel& model, const ScanEvidence& scan,
             const EvidenceOptions& options);
  ~ContrastOf();
  ContrastOf(const ContrastOf&) = delete;
  ContrastOf& operator=(const ContrastOf&) = delete;

  /// contrast(own, rival), asking no more than the first `most_samples` of those that the options allow.
  [[nodiscard]] PoseContrast against(const SizedPose& rival,
                                     std::size_t most_samples = std::numeric_limits<std::size_t>::max());

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace asbuilt::verify
