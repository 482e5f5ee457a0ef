// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/scan_assembly.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "asbuilt/io/file_map.h"

namespace asbuilt::io {
namespace {

/// Lets rows leave memory that have been read.
class ReadRows {
 public:
  ReadRows(std::string_view rows, std::size_t count) : rows_(rows), size_(count == 0 ? 0 : rows.size() / count) {}

  void reached(std::size_t row) {
    constexpr std::size_t kBytesBetweenReleases = std::size_t{16} << 20;
    const std::size_t reached = std::min(row * size_, rows_.size());
    if (reached - released_ < kBytesBetweenReleases) return;
    release_pages(rows_.substr(released_, reached - released_));
    released_ = reached;
  }

 private:
  std::string_view rows_;
  std::size_t size_, released_ = 0;
};

}  // namespace

Eigen::Vector3d precision_offset_mm(const RawPoints& points, double mm_per_unit) {
  constexpr double kLargestKept_mm = 65536.0;
  constexpr double kStep_mm = 1000.0;
  std::vector<double> values[3];
  for (std::size_t k = 0; k < std::min(kOffsetProbes, points.count); ++k) {
    Eigen::Vector3d position;
    points.positions(probe_index(k, points.count), std::span(&position, 1));
    position *= mm_per_unit;
    if (!position.allFinite() || position.isZero(0.0)) continue;
    for (int axis = 0; axis < 3; ++axis) values[axis].push_back(position[axis]);
  }
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3 && !values[axis].empty(); ++axis) {
    const auto middle = values[axis].begin() + static_cast<std::ptrdiff_t>(values[axis].size() / 2);
    std::nth_element(values[axis].begin(), middle, values[axis].end());
    if (std::abs(*middle) > kLargestKept_mm) offset[axis] = std::round(*middle / kStep_mm) * kStep_mm;
  }
  return offset;
}

MovedPositions::MovedPositions(ScanFile& scan, double mm_per_unit)
    : scan_(scan), mm_per_unit_(mm_per_unit), moved_(!scan.offset_mm.isZero(0.0)) {}

void MovedPositions::move(std::span<const Eigen::Vector3d> positions, Eigen::Vector3f* moved) {
  std::size_t no_returns = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    moved[i] = (positions[i] * mm_per_unit_ - scan_.offset_mm).cast<float>();
    if (!moved_ || !positions[i].isZero(0.0)) continue;
    moved[i].setConstant(std::numeric_limits<float>::quiet_NaN());
    ++no_returns;
  }
  if (no_returns > 0) no_returns_ += no_returns;
}

void MovedPositions::note() {
  if (moved_) {
    scan_.notes.push_back(fmt::format("Large coordinates: the offset ({:.0f}, {:.0f}, {:.0f}) mm was taken off.",
                                      scan_.offset_mm.x(), scan_.offset_mm.y(), scan_.offset_mm.z()));
  }
  if (no_returns_ > 0) {
    scan_.notes.push_back(fmt::format("{} points at exactly (0, 0, 0) were taken for missing returns.", no_returns_));
  }
}

PointValues<Eigen::Vector3d> positions_in(const std::array<StridedColumn, 3>& columns) {
  return [columns](std::size_t first, std::span<Eigen::Vector3d> out) {
    for (std::size_t axis = 0; axis < 3; ++axis) columns[axis].read(first, out.size(), out.data()->data() + axis, 3);
  };
}

PointValues<Eigen::Vector3f> normals_in(const std::array<StridedColumn, 3>& columns) {
  return [columns](std::size_t first, std::span<Eigen::Vector3f> out) {
    std::array<double, kPointsAtOnce> numbers;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      columns[axis].read(first, out.size(), numbers.data(), 1);
      for (std::size_t i = 0; i < out.size(); ++i) {
        out[i][static_cast<Eigen::Index>(axis)] = static_cast<float>(numbers[i]);
      }
    }
  };
}

PointValues<float> intensities_in(const StridedColumn& column) {
  return values_by_row<float>([column](std::size_t row) { return static_cast<float>(column[row]); });
}

ScanFile assemble_scan(const std::filesystem::path& path, std::string format, const RawPoints& points,
                       const ReadOptions& options) {
  ScanFile scan;
  scan.path = path;
  scan.name = path.stem().string();
  scan.format = std::move(format);
  scan.unit = options.unit == Unit::stated ? Unit::millimetre : options.unit;
  const double mm_per_unit = millimetres_per(options.unit);
  scan.offset_mm = precision_offset_mm(points, mm_per_unit);
  const Context context = options.threads();
  MovedPositions moved(scan, mm_per_unit);
  SievedPoints kept(scan, options.sieve.get(), points.count, context);
  if (options.sieve == nullptr || !options.sieve->applies_to(points.count)) {
    scan.cloud.positions.reserve(points.count);
    if (points.normals) scan.cloud.normals.reserve(points.count);
    if (points.colours) scan.colours.reserve(points.count);
    if (points.intensities) scan.intensities.reserve(points.count);
  }
  ReadRows rows(points.rows, points.count);
  std::vector<Eigen::Vector3f> block(std::min(points.count, SievedPoints::kLargestBlock));
  for (std::size_t first = 0; first < points.count && !kept.cancelled(); first += block.size()) {
    block.resize(std::min(block.size(), points.count - first));
    parallel_for_blocks(context, block.size(), kPointsAtOnce, [&](std::size_t begin, std::size_t end) {
      std::array<Eigen::Vector3d, kPointsAtOnce> raw;
      const std::span positions(raw.data(), end - begin);
      points.positions(first + begin, positions);
      moved.move(positions, block.data() + begin);
    });
    kept.add(block, [&](std::span<const std::uint32_t> staying) {
      append_values(scan.cloud.normals, points.normals, first, staying, context);
      append_values(scan.colours, points.colours, first, staying, context);
      append_values(scan.intensities, points.intensities, first, staying, context);
    });
    rows.reached(first + block.size());
  }
  kept.finish();
  moved.note();
  return scan;
}

Result<std::vector<ScanFile>> readable_of(const std::filesystem::path& path, std::vector<Result<ScanFile>> scans) {
  std::vector<ScanFile> readable;
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!scans[i]) {
      notes.push_back(
          fmt::format("Another scan of this file cannot be read and was left out: {}.", scans[i].error().message));
      continue;
    }
    ScanFile& scan = readable.emplace_back(std::move(*scans[i]));
    scan.path = path;
    scan.name = path.stem().string();
    if (scans.size() > 1) scan.name += fmt::format("_{:02}", i);
    scan.index_in_file = static_cast<int>(readable.size()) - 1;
  }
  if (readable.empty()) return tl::unexpected(scans.front().error());
  readable.back().notes.insert(readable.back().notes.end(), notes.begin(), notes.end());
  return readable;
}

}  // namespace asbuilt::io
