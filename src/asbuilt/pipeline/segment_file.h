// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/scan/occluders.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/detection.h"

namespace asbuilt::pipeline {

/// What segments/NNN_NAME.ply holds: the part's points of a scan and a margin around them, at full density, in the scan
/// frame minus `offset_mm`, with normals turned outwards.
struct Segment {
  PointCloud cloud;
  std::vector<std::uint8_t> is_part;  ///< one per point: 1 part, 0 margin
  /// The same as the scan half had cut it out, where the joint half has cut it anew; else empty.
  std::vector<std::uint8_t> was_part_detected;
  std::vector<std::uint8_t> beside_occluder;  ///< of each point (scan::Occluders); empty: not known
  std::vector<io::Rgb> colours;    ///< empty or one per point, from the scan's file
  std::vector<float> intensities;  ///< likewise
};

/// Cuts segment and margin out of a scan. Where the scan's own normals have no trustworthy sign, they take that of the
/// model's surface next to them, which is known once the pose is.
/// Colours and intensities come along from the file.
[[nodiscard]] Segment cut_out(const scan::Scan& scan, const io::ScanFile& file, const verify::Detection& detection,
                              const model::PreparedModel& model, const scan::Occluders& occluders,
                              const Context& context);

/// Positions are written as double where there is an offset, in the coordinates of the scan's file (mm) always.
[[nodiscard]] Result<void> write_segment(const std::filesystem::path& path, const Segment& segment,
                                         const Eigen::Vector3d& offset_mm);

/// All of a segment file, in the scan frame minus `offset_mm`. Errors: as read_part.
[[nodiscard]] Result<Segment> read_segment(const std::filesystem::path& path, const Eigen::Vector3d& offset_mm);

/// The part's points alone, as the scan half had cut it out.
struct DetectedPart {
  PointCloud cloud;                           ///< in the scan frame minus the offset
  std::vector<std::uint8_t> beside_occluder;  ///< as in Segment
};

/// Errors: unreadable_input, also when a column of ours is missing.
[[nodiscard]] Result<DetectedPart> read_part(const std::filesystem::path& path, const Eigen::Vector3d& offset_mm);

}  // namespace asbuilt::pipeline
