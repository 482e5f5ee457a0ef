// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/io/pose_file.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/run_folder.h"
#include "asbuilt/pipeline/scan_hints.h"
#include "asbuilt/pipeline/segment_file.h"

namespace asbuilt::pipeline {

/// An entry of a scan in the record, and its part if there is one.
struct JudgedScan {
  io::ScanRecord record;
  std::optional<Segment> segment;
};

/// Told, of a scan that is far denser than it takes to find the part, what was found, before the part is cut out of all
/// its points: the verdict stands, the segments are those of a thinned scan.
using EarlyVerdict = std::function<void(const io::ScanFile& file, std::span<const JudgedScan> entries)>;

/// What all scans of a run have in common.
struct ScanHalf {
  const LoadedModel& model;
  const detect::Codebook& codebook;
  const Options& options;
  const Viewpoints& viewpoints;
  const std::vector<io::NamedPose>& starts;
  EarlyVerdict early_verdict = {};  ///< may be empty
};

/// The options with the units in which model and scan were taken to be, so that a mistaken one can be named.
[[nodiscard]] Options with_units_read(const ScanHalf& half, const io::ScanFile& file);

/// Prepares a scan, detects the part in it and verifies. A scan that is far denser than that takes is thinned for it
/// (search_points.h); the part is then cut out of all points around it. Poses in the record are for the coordinates of
/// the file. One entry, or with `Instances::all` one for each placement of the part, best first; where there is none,
/// one that says why. Errors: those of the stages; nothing is decided then.
[[nodiscard]] Result<std::vector<JudgedScan>> judge_scan(const io::ScanFile& file, const ScanHalf& half,
                                                         RunFolder& folder, const Context& context);

}  // namespace asbuilt::pipeline
