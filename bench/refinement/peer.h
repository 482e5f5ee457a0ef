// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "trial.h"

namespace asbuilt::bench {

/// Open3D's multiway registration on the same views, starts and pairs as ours: point-to-plane ICP pair by pair (points
/// within 4 %, then 1 % of the diameter, Tukey's kernel), then its global optimisation of the pose graph. 3 degrees and
/// 3 % off; the product beside it. Without Open3D at build time a trial with a note says so.
[[nodiscard]] Result<std::vector<Trial>> peer_trials(const RefinementScene& scene, int seeds, const Context& context);

}  // namespace asbuilt::bench
