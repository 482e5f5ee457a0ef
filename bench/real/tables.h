// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace asbuilt::bench {

/// The Markdown tables of what `asbuilt_measure` has gathered.
[[nodiscard]] std::string tables(const nlohmann::ordered_json& figures);

}  // namespace asbuilt::bench
