// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// A pose that a user gives for a scan.
struct NamedPose {
  std::string scan;  ///< ScanFile::name, or the name of its file
  Pose model_from_scan = Pose::Identity();
};

/// Reads poses in millimetres, in the order of the file: CSV lines `name,a11,a12,...,a44` (row-major, a header line and
/// # comments allowed; commas or semicolons), or JSON `[{"scan": name, "model_from_scan": [[4x4]]}]`. `unit` is that of
/// the translations. Errors: unreadable_input naming line or entry, also for a matrix that is not a rigid motion and
/// for a scan that is named twice.
[[nodiscard]] Result<std::vector<NamedPose>> read_poses(const std::filesystem::path& path, Unit unit);

/// Writes what read_poses reads: a header line, then name,a11,...,a44 in mm. Numbers come back exactly as they were.
/// Errors: unwritable_output.
[[nodiscard]] Result<void> write_poses_csv(const std::filesystem::path& path, std::span<const NamedPose> poses);

}  // namespace asbuilt::io
