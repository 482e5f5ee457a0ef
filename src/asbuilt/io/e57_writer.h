// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/scan_file.h"

namespace asbuilt::io {

/// One scan for an E57 file. `normals`, `colours` and `intensities` are empty or one per point.
struct E57Scan {
  std::string name;
  std::vector<Eigen::Vector3d> positions_mm;  ///< in the scan's own frame; NaN for an invalid point
  std::vector<Eigen::Vector3f> normals;
  std::vector<Rgb> colours;
  std::vector<float> intensities;
  std::optional<Pose> file_from_scan;  ///< mm
};

/// Writes an E57 file (ASTM E2807-11) in metres, whole or not at all; the same scans give the same bytes. Coordinates
/// are double where float would not hold them to a micrometre; normals go into the extension "nor". Errors:
/// unwritable_output; invalid_argument for lists of different lengths.
[[nodiscard]] Result<void> write_e57(const std::filesystem::path& path, std::span<const E57Scan> scans);

}  // namespace asbuilt::io
