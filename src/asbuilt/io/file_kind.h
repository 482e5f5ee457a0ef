// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

enum class FileKind { ply, pcd, stl, off, obj, text };

/// What a file is: by its content where that tells, else by its extension.
/// Errors: unreadable_input for an empty file, for kinds that are known but not supported (with the way out), and for
/// unknown ones (with the list of the supported).
[[nodiscard]] Result<FileKind> kind_of(const std::filesystem::path& path, const Input& input);

/// Whether an STL file is text. Many binary ones also begin with "solid": their size tells.
[[nodiscard]] bool is_ascii_stl(std::string_view content);

}  // namespace asbuilt::io
