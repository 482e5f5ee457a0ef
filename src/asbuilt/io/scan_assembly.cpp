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

Eigen::Vector3d precision_offset_mm(const RawPoints& points, double mm_per_unit) {
  constexpr double kLargestKept_mm = 65536.0;
  constexpr double kStep_mm = 1000.0;
  std::vector<double> values[3];
  for (std::size_t k = 0; k < std::min(kOffsetProbes, points.count); ++k) {
    const Eigen::Vector3d position = points.position(probe_index(k, points.count)) * mm_per_unit;
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

Eigen::Vector3f MovedPositions::moved(const Eigen::Vector3d& position) {
  if (moved_ && position.isZero(0.0)) {
    ++no_returns_;
    return Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());
  }
  return (position * mm_per_unit_ - scan_.offset_mm).cast<float>();
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

ScanFile assemble_scan(const std::filesystem::path& path, std::string format, const RawPoints& points,
                       const ReadOptions& options) {
  ScanFile scan;
  scan.path = path;
  scan.name = path.stem().string();
  scan.format = std::move(format);
  scan.unit = options.unit == Unit::stated ? Unit::millimetre : options.unit;
  const double mm_per_unit = millimetres_per(options.unit);
  scan.offset_mm = precision_offset_mm(points, mm_per_unit);
  MovedPositions positions(scan, mm_per_unit);
  SievedPoints kept(scan, options.sieve.get(), points.count);
  if (options.sieve == nullptr || !options.sieve->applies_to(points.count)) {
    scan.cloud.positions.reserve(points.count);
    if (points.normal) scan.cloud.normals.reserve(points.count);
    if (points.colour) scan.colours.reserve(points.count);
    if (points.intensity) scan.intensities.reserve(points.count);
  }
  constexpr std::size_t kRowsBetweenReleases = 1 << 20;
  const std::size_t row_size = points.count == 0 ? 0 : points.rows.size() / points.count;
  for (std::size_t i = 0; i < points.count && !kept.cancelled(); ++i) {
    if (i > 0 && i % kRowsBetweenReleases == 0) {
      release_pages(points.rows.substr((i - kRowsBetweenReleases) * row_size, kRowsBetweenReleases * row_size));
    }
    if (!kept.add(positions.moved(points.position(i)))) continue;
    if (points.normal) scan.cloud.normals.push_back(points.normal(i).cast<float>());
    if (points.colour) scan.colours.push_back(points.colour(i));
    if (points.intensity) scan.intensities.push_back(static_cast<float>(points.intensity(i)));
  }
  kept.finish();
  positions.note();
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
