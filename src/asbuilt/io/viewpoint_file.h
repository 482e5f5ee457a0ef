// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// Where the sensor stood, in the scan frame.
struct NamedViewpoint {
  std::string scan;  ///< ScanFile::name, or the name of its file
  Eigen::Vector3d viewpoint_mm = Eigen::Vector3d::Zero();
};

/// Reads CSV lines `name,x,y,z`, in the order of the file (a header line and # comments allowed; commas or semicolons).
/// Errors: unreadable_input naming the line, also for a scan that is named twice.
[[nodiscard]] Result<std::vector<NamedViewpoint>> read_viewpoints(const std::filesystem::path& path, Unit unit);

}  // namespace asbuilt::io
