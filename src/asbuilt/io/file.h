// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "asbuilt/core/result.h"

namespace asbuilt::io {

/// The whole content of a file. Errors: unreadable_input (missing, a folder, no permission).
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path);

/// Writes a file whole or not at all: a temporary beside it, fsync, then rename. Errors: unwritable_output.
[[nodiscard]] Result<void> write_file(const std::filesystem::path& path, std::string_view content);

/// SHA-256 of a content, as 64 hexadecimal digits (FIPS 180-4).
[[nodiscard]] std::string sha256(std::string_view content);

}  // namespace asbuilt::io
