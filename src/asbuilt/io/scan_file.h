// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// One scan as its file gives it, in millimetres. Nothing is judged or removed here (that is scan/'s business):
/// positions may be NaN, normals of any length.
struct ScanFile {
  std::filesystem::path path;
  std::string name;  ///< file name without extension; with "_NN" when the file holds several scans
  int index_in_file = 0;
  std::string format;  ///< for example "ply binary_little_endian", "pcd ascii", "xyz"
  PointCloud cloud;    ///< in the scan frame minus `offset_mm`; normals as in the file (or empty)
  Eigen::Vector3d offset_mm = Eigen::Vector3d::Zero();  ///< taken off where coordinates are too large for float
  std::optional<Eigen::Vector3d> viewpoint_mm;          ///< from the file's pose, in the scan frame (offset included)
  std::vector<std::string> notes;                       ///< what was guessed or skipped, a sentence each
};

/// Reads all scans of a file: PLY (ascii, both endians, every scalar type; faces are ignored), PCD (ascii, binary,
/// binary_compressed), XYZ, ASC, PTS, TXT, CSV. The kind is taken from the content where it tells, else the extension.
/// Errors: unreadable_input with file, line or byte, what was found, what was expected.
[[nodiscard]] Result<std::vector<ScanFile>> read_scans(const std::filesystem::path& path, Unit unit);

}  // namespace asbuilt::io
