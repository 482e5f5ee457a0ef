// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/io/point_sieve.h"
#include "asbuilt/io/scalar_load.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::io {

/// How many points a thread decodes in one go.
constexpr std::size_t kPointsAtOnce = 1024;

/// Fills `out` with what the points from `first` on have. Asked by several threads at once, for some hundred points.
template <class T>
using PointValues = std::function<void(std::size_t first, std::span<T> out)>;

/// Of a function that knows one point.
template <class T, class Row>
[[nodiscard]] PointValues<T> values_by_row(Row row) {
  return [row = std::move(row)](std::size_t first, std::span<T> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = row(first + i);
  };
}

/// Of a list, which must outlive them.
template <class T>
[[nodiscard]] PointValues<T> values_in(const std::vector<T>& list) {
  return [&list](std::size_t first, std::span<T> out) { std::copy_n(list.data() + first, out.size(), out.data()); };
}

/// Of columns of numbers.
[[nodiscard]] PointValues<Eigen::Vector3d> positions_in(const std::array<StridedColumn, 3>& columns);
[[nodiscard]] PointValues<Eigen::Vector3f> normals_in(const std::array<StridedColumn, 3>& columns);
[[nodiscard]] PointValues<float> intensities_in(const StridedColumn& column);

/// What a reader found, before units: how many points, and where they are and point to, in the file's unit.
struct RawPoints {
  std::size_t count = 0;
  PointValues<Eigen::Vector3d> positions;
  PointValues<Eigen::Vector3f> normals;  ///< these three are empty when the file has none
  PointValues<Rgb> colours;
  PointValues<float> intensities;
  /// Rows of equal size, if that is what the file holds: those that were read may leave memory.
  std::string_view rows;
};

/// The nearest of the numbers 0 to 255; 0 of what is not finite. Without std::round, a call for each point.
[[nodiscard]] inline std::uint8_t nearest_byte(double value) {
  return static_cast<std::uint8_t>(std::isfinite(value) ? std::clamp(value, 0.0, 255.0) + 0.5 : 0.0);
}

/// How many points decide on the offset, and which: evenly spread over the index range, the same for the same file.
constexpr std::size_t kOffsetProbes = 1001;
[[nodiscard]] inline std::size_t probe_index(std::size_t probe, std::size_t count) {
  return count <= kOffsetProbes ? probe : probe * (count - 1) / (kOffsetProbes - 1);
}

/// The part of the coordinates (in mm) that is taken off so that float holds the rest: the median of the points,
/// rounded to whole metres, on each axis where it is further than 65 536 mm from zero (there a step of float is
/// 0.008 mm); zero otherwise. Points that are not finite or exactly (0,0,0) do not count.
[[nodiscard]] Eigen::Vector3d precision_offset_mm(const RawPoints& points, double mm_per_unit);

/// Brings positions into a scan whose offset is known. Where an offset is taken off, points at exactly (0,0,0), which
/// mean "no return", become NaN and a note, since they could not be told from measured points any more.
class MovedPositions {
 public:
  MovedPositions(ScanFile& scan, double mm_per_unit);

  /// In mm, offset taken off; NaN for what means "no return". By any thread.
  void move(std::span<const Eigen::Vector3d> positions_in_file_unit, Eigen::Vector3f* moved);
  void note();  ///< adds what should be known to the scan's notes

 private:
  ScanFile& scan_;
  double mm_per_unit_;
  bool moved_;
  std::atomic<std::size_t> no_returns_ = 0;
};

/// Appends to `list` the values of those points from `first` on whose places behind it are given.
template <class T>
void append_values(std::vector<T>& list, const PointValues<T>& values, std::size_t first,
                   std::span<const std::uint32_t> places, const Context& context) {
  if (!values) return;
  const std::size_t before = list.size();
  list.resize(before + places.size());
  parallel_for_blocks(context, places.size(), kPointsAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end;) {
      std::size_t run = 1;  // of neighbours
      while (i + run < end && places[i + run] == places[i] + run) ++run;
      values(first + places[i], std::span<T>(list).subspan(before + i, run));
      i += run;
    }
  });
}

/// A scan in millimetres, offset taken off, with what the file has of normals, colours and intensities, as far as the
/// sieve of the options lets it pass.
[[nodiscard]] ScanFile assemble_scan(const std::filesystem::path& path, std::string format, const RawPoints& points,
                                     const ReadOptions& options);

/// The scans of a file that could be read, with their places in it and their names (NAME, or NAME_00, NAME_01, ... when
/// the file holds several). What kept another from being read becomes a note; if none could be, the first error it is.
[[nodiscard]] Result<std::vector<ScanFile>> readable_of(const std::filesystem::path& path,
                                                        std::vector<Result<ScanFile>> scans);

}  // namespace asbuilt::io
