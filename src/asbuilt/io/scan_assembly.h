// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/io/point_sieve.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// What a reader found, before units: how many points, and where the i-th is and points to, in the file's unit.
struct RawPoints {
  std::size_t count = 0;
  std::function<Eigen::Vector3d(std::size_t)> position;
  std::function<Eigen::Vector3d(std::size_t)> normal;  ///< these three are empty when the file has none
  std::function<Rgb(std::size_t)> colour;
  std::function<double(std::size_t)> intensity;
  /// Rows of equal size, if that is what the file holds: those that were read may leave memory.
  std::string_view rows;
};

/// How many points decide on the offset, and which: evenly spread over the index range, the same for the same file.
constexpr std::size_t kOffsetProbes = 1001;
[[nodiscard]] inline std::size_t probe_index(std::size_t probe, std::size_t count) {
  return count <= kOffsetProbes ? probe : probe * (count - 1) / (kOffsetProbes - 1);
}

/// The part of the coordinates (in mm) that is taken off so that float holds the rest: the median of the points,
/// rounded to whole metres, on each axis where it is further than 65 536 mm from zero (there a step of float is
/// 0.008 mm); zero otherwise. Points that are not finite or exactly (0,0,0) do not count.
[[nodiscard]] Eigen::Vector3d precision_offset_mm(const RawPoints& points, double mm_per_unit);

/// Appends positions to a scan whose offset is known. Where an offset is taken off, points at exactly (0,0,0), which
/// mean "no return", become NaN and a note, since they could not be told from measured points any more.
class MovedPositions {
 public:
  MovedPositions(ScanFile& scan, double mm_per_unit);

  /// In mm, offset taken off; NaN for what means "no return".
  [[nodiscard]] Eigen::Vector3f moved(const Eigen::Vector3d& position_in_file_unit);
  void add(const Eigen::Vector3d& position_in_file_unit) {
    scan_.cloud.positions.push_back(moved(position_in_file_unit));
  }
  void note();  ///< adds what should be known to the scan's notes

 private:
  ScanFile& scan_;
  double mm_per_unit_;
  bool moved_;
  std::size_t no_returns_ = 0;
};

/// A scan in millimetres, offset taken off, with what the file has of normals, colours and intensities, as far as the
/// sieve of the options lets it pass.
[[nodiscard]] ScanFile assemble_scan(const std::filesystem::path& path, std::string format, const RawPoints& points,
                                     const ReadOptions& options);

/// The scans of a file that could be read, with their places in it and their names (NAME, or NAME_00, NAME_01, ... when
/// the file holds several). What kept another from being read becomes a note; if none could be, the first error it is.
[[nodiscard]] Result<std::vector<ScanFile>> readable_of(const std::filesystem::path& path,
                                                        std::vector<Result<ScanFile>> scans);

}  // namespace asbuilt::io
