// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::pipeline {

/// Why the part cannot be found in a scan of this size, in one sentence with the flag that may help; nothing if it can.
/// Only where detection is impossible: the scan's extent is below 5 % of the diameter, or its points lie so far apart
/// that fewer than 50 could fall on the part (architecture.md, section 1, Unit).
[[nodiscard]] std::optional<std::string> size_contradiction(const scan::Scan& scan, const model::PreparedModel& model,
                                                            const Options& options);

/// Factors by which a mistaken unit scales a scan, and that bring this one to a plausible size.
[[nodiscard]] std::vector<double> plausible_factors(double scan_extent_mm, double diameter_mm);

/// The flag that would scale the scan by `factor` against the model, for example "--scan-unit m"; with a scan's name,
/// the one for it alone, "--scan-unit scan_03.ply:m".
[[nodiscard]] std::string flag_for_factor(double factor, const Options& options, const std::string& scan = {});

/// Whether the part would be found if the scan were of another unit: tries the plausible factors on a thinned copy.
/// Gives the first that verification accepts.
[[nodiscard]] std::optional<double> factor_that_finds_the_part(const io::ScanFile& file,
                                                               const model::PreparedModel& model,
                                                               const detect::Codebook& codebook, const Options& options,
                                                               const Context& context);

}  // namespace asbuilt::pipeline
