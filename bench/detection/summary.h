// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "record.h"

namespace asbuilt::bench {

/// The figures of all records, mode by mode and group by group: recall per stratum and part with Wilson intervals,
/// precision, decoys, seconds, misses and wrong poses by name.
[[nodiscard]] nlohmann::ordered_json summary_of(std::span<const CaseRecord> records);

/// The same as Markdown tables.
[[nodiscard]] std::string tables(const nlohmann::ordered_json& summary);

}  // namespace asbuilt::bench
