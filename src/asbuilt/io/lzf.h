// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace asbuilt::io {

/// Expands an LZF stream (the compression inside PCD files) to exactly `size` bytes; nothing if it is damaged.
[[nodiscard]] std::optional<std::string> lzf_expand(std::string_view compressed, std::size_t size);

/// The most bytes that a stream of this length can expand to.
[[nodiscard]] std::size_t lzf_largest_expansion(std::size_t compressed_size);

}  // namespace asbuilt::io
