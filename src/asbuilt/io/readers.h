// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/pose_file.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/io/unit.h"
#include "asbuilt/io/viewpoint_file.h"

namespace asbuilt::io {

/// read_scans and read_model once the file is in memory: they find out its kind and call one of the readers below.
[[nodiscard]] Result<std::vector<ScanFile>> scans_from(const std::filesystem::path& path, const Input& input,
                                                       const ReadOptions& options);
[[nodiscard]] Result<ModelFile> model_from(const std::filesystem::path& path, const Input& input,
                                           const ModelReadOptions& options);
[[nodiscard]] Result<TriangleMesh> mesh_from(const std::filesystem::path& path, const Input& input, Unit unit);

// One reader per kind of file. Meshes come in the file's unit and may be empty.

using ScanReaderFunction = Result<std::vector<ScanFile>>(const std::filesystem::path& path, const Input& input,
                                                         const ReadOptions& options);
[[nodiscard]] ScanReaderFunction read_ply_scan, read_pcd_scan, read_text_scan, read_e57_scans, read_ptx_scans,
    read_las_scan, read_depth_scan;

/// Whether a text begins like a PTX file: two counts, then four lines of three numbers and four of four.
[[nodiscard]] bool is_ptx(std::string_view content);

[[nodiscard]] Result<TriangleMesh> read_ply_mesh(const Input& input);
[[nodiscard]] Result<TriangleMesh> read_stl_mesh(const Input& input);
[[nodiscard]] Result<TriangleMesh> read_off_mesh(const Input& input);
[[nodiscard]] Result<TriangleMesh> read_obj_mesh(const Input& input);

[[nodiscard]] Result<std::vector<NamedPose>> poses_from(const Input& input, Unit unit);
[[nodiscard]] Result<std::vector<NamedViewpoint>> viewpoints_from(const Input& input, Unit unit);

}  // namespace asbuilt::io
