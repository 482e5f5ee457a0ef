// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/large_planes.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/detection.h"

namespace asbuilt::pipeline {

/// A scan of which the part was sought in fewer points than there are.
struct ThinnedSearch {
  const io::ScanFile& file;            ///< as it was read, or as a sieve let it through
  double spacing_mm = 0.0;             ///< of the points in which the part was sought, about
  bool poses_are_final = false;        ///< they were registered to as many points as there is use for
  scan::Viewpoint viewpoint;           ///< that was decided on, without the file's offset
  const detect::SampledScan& sampled;  ///< as detection looked at it
};

/// The points around the part at full density, of a scan that was thinned to find it.
struct CloserLook {
  io::ScanFile file;
  scan::Scan scan;
  std::vector<verify::Detection> placements;  ///< what was said of them stays; poses and segments are of `scan`
};

/// Keeps all points that lie around the placements that have a segment - where a sieve took some, out of the file, read
/// once more -, registers the placements to them unless their poses are final, and cuts them out anew. Verdicts,
/// reasons and candidates remain those of the search, since what is far from the part cannot be asked here.
///
/// Memory: at most that of reading the scan. Errors: those of reading and preparing; not_possible where a pose moves by
/// more than the thinned scan leaves open; cancelled.
[[nodiscard]] Result<CloserLook> look_closer(const ThinnedSearch& search, std::vector<verify::Detection> placements,
                                             const LoadedModel& model, const Options& options, const Context& context);

}  // namespace asbuilt::pipeline
