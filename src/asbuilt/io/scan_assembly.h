// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "asbuilt/io/scan_file.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// What a reader found, before units: how many points, and where the i-th is and points to, in the file's unit.
struct RawPoints {
  std::size_t count = 0;
  std::function<Eigen::Vector3d(std::size_t)> position;
  std::function<Eigen::Vector3d(std::size_t)> normal;  ///< empty when the file has none
};

/// The part of the coordinates (in mm) that is taken off so that float holds the rest: the median of the points,
/// rounded to whole metres, on each axis where it is further than 65 536 mm from zero (there a step of float is
/// 0.008 mm); zero otherwise. Points that are not finite or exactly (0,0,0) do not count.
[[nodiscard]] Eigen::Vector3d precision_offset_mm(const RawPoints& points, double mm_per_unit);

/// A scan in millimetres, offset taken off. Where an offset is taken off, points at exactly (0,0,0), which mean "no
/// return", become NaN and a note, since they could not be told from measured points any more.
[[nodiscard]] ScanFile assemble_scan(const std::filesystem::path& path, std::string format, const RawPoints& points,
                                     Unit unit);

}  // namespace asbuilt::io
