// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/context.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/symmetry.h"

namespace asbuilt::model {

/// How much of a model comes to lie on itself under a motion.
struct SelfMatch {
  double share = 0.0;                                   ///< of the surface
  double broken_area = 0.0;                             ///< mm^2 that do not
  Eigen::Vector3d breaks_at = Eigen::Vector3d::Zero();  ///< middle of these, before the motion
};

/// Matches the model to itself under one motion: a spot agrees if its image lies within 0.5 % of the diameter of the
/// skin (what an as-built part may deviate anyway) and faces the same way. Asks all dense samples.
class SelfMatching {
 public:
  explicit SelfMatching(const PreparedModel& model);
  ~SelfMatching();
  SelfMatching(SelfMatching&&) noexcept;
  SelfMatching& operator=(SelfMatching&&) noexcept;

  [[nodiscard]] SelfMatch match(const Pose& motion) const;

  /// Whether what breaks is smaller than a scan would show: (2 % of the diameter)^2.
  [[nodiscard]] bool is_symmetry(const SelfMatch& match) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Finds the rotations that map the model onto itself, exactly or nearly, by matching it to itself (docs/model.md).
/// Needs everything of the model but its symmetry. Deterministic. Cost: some 0.2 s of CPU time.
[[nodiscard]] SymmetryGroup find_symmetry(const PreparedModel& model, const Context& context);

}  // namespace asbuilt::model
