// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/options.h"
#include "asbuilt/pipeline/point_columns.h"
#include "asbuilt/report/report.h"

namespace asbuilt::pipeline {

/// What `asbuilt inspect` measures.
struct MeasuredCloud {
  PointCloud cloud;      ///< in the model frame, mm
  PointColumns columns;  ///< what a reconstruction.ply says of its points; empty for other clouds
  report::InputFile file;
};

/// The points of a cloud, or even samples of a mesh; of a reconstruction also what it says of each point. Errors:
/// unreadable_input.
[[nodiscard]] Result<MeasuredCloud> measured_cloud(const std::string& path, const LoadedModel& model,
                                                   const Options& options, const Context& context);

/// A record that knows its model and version and no scans.
[[nodiscard]] io::RunRecord record_of_model(const LoadedModel& model);

}  // namespace asbuilt::pipeline
