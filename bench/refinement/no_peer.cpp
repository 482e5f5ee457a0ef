// SPDX-License-Identifier: Apache-2.0
#include "peer.h"

namespace asbuilt::bench {

Result<std::vector<Trial>> peer_trials(const RefinementScene& scene, int /*seeds*/, const Context& /*context*/) {
  return std::vector<Trial>{{"peer", scene.name, "Open3D multiway", 0, {}, "Open3D was not there at build time"}};
}

}  // namespace asbuilt::bench
