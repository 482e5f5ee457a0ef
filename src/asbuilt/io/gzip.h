// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

[[nodiscard]] bool is_gzip(std::string_view content);

/// "scan.xyz" for "scan.xyz.gz": the extension then tells the kind as usual.
[[nodiscard]] std::filesystem::path name_without_gz(const std::filesystem::path& path);

/// What a gzip file holds (RFC 1952, also several members); its checksums are verified.
/// Errors: unreadable_input for a file that is damaged, cut short, or too large for memory.
[[nodiscard]] Result<std::string> gunzip(const Input& input);

/// Expands a zlib stream (RFC 1950) to exactly `expected` bytes. Errors: unreadable_input.
[[nodiscard]] Result<std::string> inflate_to(const Input& input, std::string_view stream, std::size_t expected);

/// The most bytes that so many can expand to (RFC 1951: 258 for every two bits, in the limit).
[[nodiscard]] constexpr std::size_t largest_expansion(std::size_t bytes) { return 1040 * bytes + 64; }

}  // namespace asbuilt::io
