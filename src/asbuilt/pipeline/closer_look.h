// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/detection.h"

namespace asbuilt::pipeline {

/// The points around the part at full density, of a scan that was thinned to find it.
struct CloserLook {
  io::ScanFile file;
  scan::Scan scan;
  std::vector<verify::Detection> placements;  ///< what was said of them stays; poses and segments are of `scan`
};

/// Reads the file of a thinned scan once more, keeps what lies around the placements that have a segment, registers
/// them to that and cuts them out anew. Verdicts, reasons and candidates remain those of the whole scan, since what is
/// far from the part cannot be asked here.
///
/// `viewpoint` is the one that was decided on, without the file's offset. Memory: at most that of the first look.
/// Errors: those of reading and preparing; not_possible where a pose moves by more than the thinned scan leaves open;
/// cancelled.
[[nodiscard]] Result<CloserLook> look_closer(const io::ScanFile& thinned, const scan::Viewpoint& viewpoint,
                                             std::vector<verify::Detection> placements, const LoadedModel& model,
                                             const Options& options, const Context& context);

}  // namespace asbuilt::pipeline
