// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "asbuilt/core/pose.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/report/colours.h"
#include "asbuilt/report/report.h"

// The pieces of report.json (docs/report-json.md); only this folder's sources include it.
namespace asbuilt::report {

using Json = nlohmann::ordered_json;

// Shapes that repeat: lengths in mm, what is unknown as null.
[[nodiscard]] Json optional_number(const std::optional<double>& value);
[[nodiscard]] Json text_or_null(const std::string& text);
[[nodiscard]] Json triple(const Eigen::Vector3d& v);
[[nodiscard]] Json pose_json(const Pose& pose);  ///< sixteen numbers, row by row
[[nodiscard]] Json tolerance_json(const std::optional<inspect::Tolerance>& tolerance);
[[nodiscard]] Json statistics_json(const inspect::DeviationStatistics& statistics);

// Sections about the part as a whole.
[[nodiscard]] Json coverage_json(const inspect::DeviationReport& deviations);
[[nodiscard]] Json significance_json(const ReportInput& input);
[[nodiscard]] Json histogram_json(const inspect::DeviationReport& deviations, double range_mm);
[[nodiscard]] Json colours_json(const ColourMap& colours);

// Sections about pieces of it.
[[nodiscard]] Json faces_json(const inspect::DeviationReport& deviations, const io::CadFaceNames& names);
[[nodiscard]] Json boxes_json(const inspect::DeviationReport& deviations);
[[nodiscard]] Json regions_json(const inspect::DeviationReport& deviations);

// Sections about what it was measured with.
[[nodiscard]] Json scans_json(const ReportInput& input);
[[nodiscard]] Json graph_json(const io::RunRecord& record);
[[nodiscard]] Json refinement_json(const io::RunRecord& record);
[[nodiscard]] Json reference_json(const ReportInput& input);

}  // namespace asbuilt::report
