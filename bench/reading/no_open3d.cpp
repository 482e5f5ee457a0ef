// SPDX-License-Identifier: Apache-2.0
#include "peers.h"

namespace asbuilt::bench {

std::optional<PeerPoints> read_with_open3d(const std::string&) { return std::nullopt; }

}  // namespace asbuilt::bench
