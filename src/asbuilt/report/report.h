// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/report/colours.h"

namespace asbuilt::report {

/// A file that went in beside the model and the scans.
struct InputFile {
  std::string path, sha256;
};

/// All that a report tells of. References must outlive the call.
struct ReportInput {
  std::string verb;                    ///< reconstruct, register, inspect
  std::vector<std::string> arguments;  ///< as given, without what cannot change the result
  const io::RunRecord& record;         ///< model, scans, graph, refinement, options; no scans for `inspect`
  const model::PreparedModel& model;
  const inspect::DeviationReport& deviations;
  const inspect::InspectOptions& options;
  std::size_t points = 0;                  ///< of the cloud that was inspected
  std::optional<InputFile> measured = {};  ///< the cloud of `inspect`
  std::optional<InputFile> tolerance_file = {};
  std::optional<InputFile> reference_file = {};
  std::optional<std::string> cloud_file = {};  ///< what was written with deviations, relative to the report
  std::optional<std::string> mesh_file = {};
  std::optional<std::string> closed_mesh_file = {};  ///< the watertight one
  bool views = false;  ///< also pictures, without a browser
  bool steps = false;  ///< pictures in discrete colours
};

/// The colours of this report.
[[nodiscard]] ColourMap colours_of(const ReportInput& input);

/// Text of report.json (docs/report-json.md).
[[nodiscard]] std::string report_json(const ReportInput& input);

/// Two sentences for people.
[[nodiscard]] std::string summary_of(const ReportInput& input);

/// CSV twins: header and one line each. Points only for `inspect`'s check points and spots; clouds are PLY files.
[[nodiscard]] std::string spots_csv(const ReportInput& input);
[[nodiscard]] std::string faces_csv(const ReportInput& input);
[[nodiscard]] std::string regions_csv(const ReportInput& input);
[[nodiscard]] std::string scans_csv(const ReportInput& input);
[[nodiscard]] std::string reference_csv(const ReportInput& input);

/// Writes report.json, report.html, the CSV twins and, if wanted, views/*.png into a folder, each whole or not at all;
/// takes away views and reference.csv of an earlier run that this one does not have. Errors: unwritable_output.
[[nodiscard]] Result<void> write_report(const std::filesystem::path& folder, const ReportInput& input,
                                        const Context& context);

/// Names of all files that write_report may leave.
[[nodiscard]] std::vector<std::string> report_files();

}  // namespace asbuilt::report
