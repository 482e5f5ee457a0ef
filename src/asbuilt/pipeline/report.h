// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/fuse/fuse.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/io/run_record.h"

namespace asbuilt::pipeline {

/// The figures of result.json: over surface area, not over raw points, which would count what was scanned densely
/// twice.
[[nodiscard]] io::DeviationRecord recorded_deviation(const inspect::DeviationReport& deviations);

/// report.json (docs/inspect.md): part, scans, alignment, tolerance and all statistics. `record` gives the model, the
/// scans and the gauge; for a cloud that was inspected alone it has no scans.
[[nodiscard]] Result<void> write_report(const std::filesystem::path& path, const io::RunRecord& record,
                                        const inspect::DeviationReport& deviations,
                                        const inspect::InspectOptions& options);

/// reconstruction.ply with the columns of the contract.
[[nodiscard]] Result<void> write_reconstruction(const std::filesystem::path& path,
                                                const fuse::Reconstruction& reconstruction,
                                                std::span<const float> deviation_mm);

/// A cloud in the model frame with its deviations, for `asbuilt inspect`.
[[nodiscard]] Result<void> write_deviations(const std::filesystem::path& path, const PointCloud& cloud_in_model,
                                            std::span<const float> deviation_mm);

}  // namespace asbuilt::pipeline
