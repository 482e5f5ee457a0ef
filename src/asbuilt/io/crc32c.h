// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace asbuilt::io {

/// CRC-32C (Castagnoli; reflected polynomial 0x82F63B78, start and final value all ones), as E57 pages carry it.
[[nodiscard]] std::uint32_t crc32c(std::string_view bytes);

/// The same without the instruction that most processors have for it.
[[nodiscard]] std::uint32_t crc32c_by_tables(std::string_view bytes);

}  // namespace asbuilt::io
