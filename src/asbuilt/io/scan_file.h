// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/read_options.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

using Rgb = std::array<std::uint8_t, 3>;

/// Rows and columns of a structured scan: how the sensor swept, whether or not every cell holds a point.
struct ScanGrid {
  std::uint64_t rows = 0, columns = 0;
};

/// What became of a scan that was too large to be kept whole.
struct Thinning {
  std::uint64_t points_in_file = 0;  ///< that are some: finite and not at (0, 0, 0)
  double spacing_mm = 0.0;           ///< edge of the cubes of which each kept one point
};

/// One scan as its file gives it, in millimetres. Nothing is judged or removed here (that is scan/'s business):
/// positions may be NaN, normals of any length.
struct ScanFile {
  std::filesystem::path path;
  std::string name;  ///< file name without extension; with "_NN" when the file holds several scans
  int index_in_file = 0;
  std::string title;   ///< what the file itself calls the scan; often empty
  std::string format;  ///< for example "ply binary_little_endian", "pcd ascii", "xyz"
  PointCloud cloud;    ///< in the scan frame minus `offset_mm`; normals as in the file (or empty)
  Eigen::Vector3d offset_mm = Eigen::Vector3d::Zero();  ///< taken off where coordinates are too large for float
  std::optional<Eigen::Vector3d> viewpoint_mm;          ///< from the file's pose, in the scan frame (offset included)
  std::optional<Pose> file_from_scan;                   ///< where the file places the scan, mm; none if it says nothing
  std::vector<Rgb> colours;                             ///< empty or one per point
  std::vector<float> intensities;                       ///< empty or one per point, on the file's own scale
  std::optional<Thinning> thinning;                     ///< set where a sieve left some of the points out
  std::optional<ScanGrid> grid;                         ///< of a scan that knows its rows and columns
  Unit unit = Unit::millimetre;                         ///< in which the file was taken to be
  std::vector<std::string> notes;                       ///< what was guessed or skipped, a sentence each
};

/// Reads all scans of a file: PLY, PCD, E57, PTX, LAS, text in columns, depth images, and the vertices of meshes
/// (docs/io.md lists them). The kind is taken from the content where it tells, else from the extension.
///
/// Where a file holds several scans and one of them is damaged, the others come with a note on it. A scan of an E57,
/// LAS or PTX file may be empty, if that is what the file says. Errors: unreadable_input with file, line or byte, what
/// was found, what was expected.
[[nodiscard]] Result<std::vector<ScanFile>> read_scans(const std::filesystem::path& path, const ReadOptions& options);

/// The same for a file whose content is at hand, so that who also hashes it need not read it twice.
[[nodiscard]] Result<std::vector<ScanFile>> scans_in(const std::filesystem::path& path, std::string_view content,
                                                     const ReadOptions& options);

}  // namespace asbuilt::io
