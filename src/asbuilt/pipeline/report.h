// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/fuse/fuse.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/report/colours.h"

namespace asbuilt::pipeline {

/// The figures of result.json: over surface area, not over raw points, which would count what was scanned densely
/// twice.
[[nodiscard]] io::DeviationRecord recorded_deviation(const inspect::DeviationReport& deviations);

/// reconstruction.ply with the columns of the contract, and the colours of the deviations.
[[nodiscard]] Result<void> write_reconstruction(const std::filesystem::path& path,
                                                const fuse::Reconstruction& reconstruction,
                                                std::span<const float> deviation_mm, const report::ColourMap& colours);

/// A cloud in the model frame with its deviations and their colours, for `asbuilt inspect`.
[[nodiscard]] Result<void> write_deviations(const std::filesystem::path& path, const PointCloud& cloud_in_model,
                                            std::span<const float> deviation_mm, const report::ColourMap& colours);

/// A mesh in the model frame with the deviation of each vertex, after the alignment of the report, and its colour.
[[nodiscard]] Result<void> write_coloured_mesh(const std::filesystem::path& path, const TriangleMesh& mesh,
                                               const model::PreparedModel& model,
                                               const inspect::DeviationReport& deviations,
                                               const report::ColourMap& colours, const Context& context);

/// The mesh without holes (inspect/closed_mesh.h) in the frame of the reconstruction: `deviation` is NaN, `filled` 1 and
/// the colour that of what was not scanned where nothing was measured. Errors: also not_possible, if nothing was.
[[nodiscard]] Result<void> write_closed_mesh(const std::filesystem::path& path, const model::PreparedModel& model,
                                             const inspect::DeviationReport& deviations,
                                             const report::ColourMap& colours, const Context& context);

}  // namespace asbuilt::pipeline
