// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/recut_segments.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "asbuilt/fuse/recut.h"
#include "asbuilt/pipeline/segment_file.h"

namespace asbuilt::pipeline {
namespace {

namespace fs = std::filesystem;

const io::ScanRecord& record_of(const PosedScan& scan, const io::RunRecord& record) {
  return record.scans[static_cast<std::size_t>(scan.index)];
}

fs::path file_of(const PosedScan& scan, const io::RunRecord& record, const RunFolder& folder) {
  return folder.file(io::segment_file(static_cast<std::size_t>(scan.index), record_of(scan, record).name));
}

/// As the scan half had cut it out, but for the points that were taken out before the poses were refined anew.
Result<Segment> segment_of(const PosedScan& scan, const io::RunRecord& record, const RunFolder& folder) {
  ASBUILT_TRY(segment, read_segment(file_of(scan, record, folder), record_of(scan, record).offset));
  if (segment.was_part_detected.empty()) segment.was_part_detected = segment.is_part;
  segment.is_part = segment.was_part_detected;
  std::uint32_t place = 0;
  auto taken = scan.taken_from.begin();
  for (std::uint8_t& is_part : segment.is_part) {
    if (is_part == 0) continue;
    if (taken != scan.taken_from.end() && *taken == place) {
      is_part = 0;
      ++taken;
    }
    ++place;
  }
  return std::move(segment);
}

/// The margin of a placement may be the part of another one in the same scan: no point may belong to both.
void keep_only_detected(Segment& segment) {
  for (std::size_t i = 0; i < segment.is_part.size(); ++i) segment.is_part[i] &= segment.was_part_detected[i];
}

/// `left_out`: one byte a point, or empty.
fuse::PosedSegment part_of(const Segment& segment, const std::vector<std::uint8_t>& left_out, const PosedScan& scan) {
  fuse::PosedSegment part;
  part.model_from_scan = scan.model_from_local;
  part.noise_sigma_mm = scan.noise_sigma_mm;
  part.scan_index = scan.index;  // the spacing is measured: a hall has another than the part in it
  for (std::size_t i = 0; i < segment.is_part.size(); ++i) {
    if (segment.is_part[i] == 0 || (!left_out.empty() && left_out[i] != 0)) continue;
    part.segment_in_scan.positions.push_back(segment.cloud.positions[i]);
    part.segment_in_scan.normals.push_back(segment.cloud.normals[i]);
    if (!segment.colours.empty()) part.colours.push_back(segment.colours[i]);
    if (!segment.intensities.empty()) part.intensities.push_back(segment.intensities[i]);
  }
  return part;
}

}  // namespace

Result<std::vector<fuse::PosedSegment>> recut_segments(const RefinedComponent& component, std::vector<PosedScan>& scans,
                                                       const io::RunRecord& record, const Options& options,
                                                       const RunFolder& folder, const Context& context) {
  std::vector<Segment> segments;
  std::vector<fuse::SeenSegment> seen;
  for (const int member : component.members) {
    PosedScan& scan = scans[static_cast<std::size_t>(member)];
    scan.part = scan.taken_out = {};
    scan.sample.reset();
    ASBUILT_TRY(segment, segment_of(scan, record, folder));
    seen.push_back(
        {std::move(segment.cloud), segment.is_part, scan.model_from_local, scan.noise_sigma_mm, scan.viewpoint});
    segments.push_back(std::move(segment));
  }
  std::vector<fuse::RecutSegment> cut(segments.size());
  if (!options.paper_mode) {
    ASBUILT_TRY(cut_anew, fuse::recut(seen, context));
    cut = std::move(cut_anew);
  }
  std::vector<fuse::PosedSegment> parts;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const PosedScan& scan = scans[static_cast<std::size_t>(component.members[i])];
    Segment& segment = segments[i];
    segment.cloud = std::move(seen[i].cloud_in_scan);
    if (!options.paper_mode) {
      segment.is_part = std::move(cut[i].is_part);
      if (record_of(scan, record).instances_in_scan > 1) keep_only_detected(segment);
      ASBUILT_CHECK(write_segment(file_of(scan, record, folder), segment, record_of(scan, record).offset));
    }
    parts.push_back(part_of(segment, cut[i].in_doubt, scan));
    segment = {};
  }
  return parts;
}

Result<void> restore_segments(const std::vector<PosedScan>& kept, const io::RunRecord& record,
                              const RunFolder& folder) {
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const io::ScanRecord& scan = record.scans[i];
    const fs::path path = folder.file(io::segment_file(i, scan.name));
    const bool is_kept =
        std::ranges::any_of(kept, [&](const PosedScan& posed) { return posed.index == static_cast<int>(i); });
    if (std::error_code ignored; is_kept || !scan.has_segment() || !fs::exists(path, ignored)) continue;
    ASBUILT_TRY(segment, read_segment(path, scan.offset));
    if (segment.was_part_detected.empty()) continue;
    segment.is_part = std::exchange(segment.was_part_detected, {});
    ASBUILT_CHECK(write_segment(path, segment, scan.offset));
  }
  return {};
}

}  // namespace asbuilt::pipeline
