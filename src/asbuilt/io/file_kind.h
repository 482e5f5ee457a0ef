// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>

#include "asbuilt/core/result.h"
#include "asbuilt/io/input.h"

namespace asbuilt::io {

enum class FileKind { ply, pcd, stl, off, obj, text, e57, ptx, las, depth_png, step, iges, brep };

/// "ply", "step", ...
[[nodiscard]] std::string_view name_of(FileKind kind);

/// Whether such a file holds CAD surfaces, which only OpenCASCADE reads.
[[nodiscard]] bool is_cad(FileKind kind);

/// What a file is: by its content where that tells, else by its extension.
/// Errors: unreadable_input for an empty file, for kinds that are known but not supported (with the way out), and for
/// unknown ones (with the list of the supported).
[[nodiscard]] Result<FileKind> kind_of(const std::filesystem::path& path, const Input& input);

/// By the extension alone, in lower case, ".ply"; nothing for unknown ones.
[[nodiscard]] std::optional<FileKind> kind_from_extension(std::string_view extension);

/// Whether an STL file is text. Many binary ones also begin with "solid": their size tells.
[[nodiscard]] bool is_ascii_stl(std::string_view content);

}  // namespace asbuilt::io
