// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// Reads a triangle mesh in millimetres as the file has it (not welded): PLY, STL, OBJ, OFF; ascii and binary.
/// Polygons are split into fans. Errors: unreadable_input, also for a mesh without triangles or a vertex index out of
/// range.
[[nodiscard]] Result<TriangleMesh> read_mesh(const std::filesystem::path& path, Unit unit);

/// Binary little-endian PLY, written whole or not at all.
[[nodiscard]] Result<void> write_mesh_ply(const std::filesystem::path& path, const TriangleMesh& mesh);

}  // namespace asbuilt::io
