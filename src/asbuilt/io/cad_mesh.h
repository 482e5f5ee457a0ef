// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "asbuilt/core/result.h"
#include "asbuilt/io/file_kind.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/mesh_file.h"

namespace asbuilt::io {

/// Tessellates the surfaces of a STEP, IGES or BREP file. Where the file lies at `path` and not only in `input`, it is
/// read from there. Errors: unreadable_input, also when this program was built without OpenCASCADE.
[[nodiscard]] Result<ModelFile> read_cad(const std::filesystem::path& path, FileKind kind, const Input& input,
                                         const ModelReadOptions& options);

}  // namespace asbuilt::io
