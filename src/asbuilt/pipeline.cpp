// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline.h"

#include <algorithm>
#include <array>
#include <optional>

#include "asbuilt/core/parallel.h"
#include "asbuilt/pipeline/collect_runs.h"
#include "asbuilt/pipeline/inspection_inputs.h"
#include "asbuilt/pipeline/joint_half.h"
#include "asbuilt/pipeline/load_model.h"
#include "asbuilt/pipeline/measured_cloud.h"
#include "asbuilt/pipeline/report.h"
#include "asbuilt/pipeline/run_folder.h"
#include "asbuilt/pipeline/scan_half.h"
#include "asbuilt/report/report.h"

// The whole method, a stage a line. The stages of one scan are in pipeline/judge_scan.cpp (Sec. 3.1), those of all
// scans together in pipeline/joint_half.cpp (Sec. 3.2 and after).
namespace asbuilt::pipeline {
namespace {

/// Opens the output folder before the long work, so that a mistake there costs nothing.
Result<RunFolder> open(const Output& output, std::string_view command, const Context& context) {
  ASBUILT_TRY(folder, RunFolder::open(output.folder, command, output.force, context.arena().threads()));
  folder.on_stage = output.on_stage;
  folder.arguments = output.arguments;
  return std::move(folder);
}

Result<LoadedModel> prepared(const std::string& path, const Options& options, RunFolder& folder, const Context& context,
                             model::PreparedFor use = model::PreparedFor::everything) {
  const auto timed = folder.stage("prepare_model");
  return load_model(path, options, context, use);
}

/// What can be said of a scan half alone: without a readable scan the run has failed.
io::RunState state_after_detection(const io::RunRecord& record) {
  const bool any = std::ranges::any_of(
      record.scans, [](const io::ScanRecord& scan) { return scan.status != io::ScanStatus::failed; });
  return any ? io::RunState::complete : io::RunState::failed;
}

}  // namespace

Result<io::RunRecord> reconstruct(const std::string& model_path, std::span<const std::string> scan_paths,
                                  const Options& chosen, const Output& output, const Context& context) {
  ASBUILT_CHECK(chosen.validate());
  const Options options = with_paper_mode_applied(chosen);
  ASBUILT_TRY(inputs, inspection_inputs(options));
  ASBUILT_TRY(folder, open(output, "reconstruct", context));
  ASBUILT_TRY(model, prepared(model_path, options, folder, context));
  ASBUILT_TRY(record, detect_scans(model, scan_paths, options, folder, context));
  record.options = merged(std::move(record.options), recorded(options, {Half::joint}));
  ASBUILT_CHECK(register_scans(model, options, inputs, folder, record, context));
  ASBUILT_CHECK(folder.finish(record));
  return std::move(record);
}

Result<io::RunRecord> detect(const std::string& model_path, std::span<const std::string> scan_paths,
                             const Options& chosen, const Output& output, const Context& context) {
  ASBUILT_CHECK(chosen.validate());
  const Options options = with_paper_mode_applied(chosen);
  ASBUILT_TRY(folder, open(output, "detect", context));
  ASBUILT_TRY(model, prepared(model_path, options, folder, context));
  ASBUILT_TRY(record, detect_scans(model, scan_paths, options, folder, context));
  record.state = state_after_detection(record);
  ASBUILT_CHECK(folder.finish(record));
  return std::move(record);
}

Result<io::RunRecord> register_runs(std::span<const std::string> run_folders,
                                    const std::optional<std::string>& model_path, const Options& chosen,
                                    const Output& output, const Context& context) {
  ASBUILT_CHECK(chosen.validate());
  ASBUILT_TRY(inputs, inspection_inputs(chosen));
  ASBUILT_TRY(folder, open(output, "register", context));
  ASBUILT_TRY(record, collect_runs(run_folders, chosen, folder));
  ASBUILT_TRY(options, joint_options(chosen, record));
  ASBUILT_TRY(model, prepared(model_path.value_or(record.model.path), options, folder, context));
  ASBUILT_CHECK(check_same_model(model, record));
  record.options = merged(std::move(record.options), recorded(options, {Half::joint}));
  record.options = merged(std::move(record.options), choices_about_scans(chosen));
  ASBUILT_CHECK(register_scans(model, options, inputs, folder, record, context));
  ASBUILT_CHECK(folder.finish(record));
  return std::move(record);
}

Result<inspect::DeviationReport> inspect_cloud(const std::string& model_path, const std::string& cloud_path,
                                               const Options& options, const Output& output, const Context& context) {
  ASBUILT_CHECK(options.validate());
  ASBUILT_TRY(inputs, inspection_inputs(options));
  ASBUILT_TRY(folder, open(output, "inspect", context));
  ASBUILT_TRY(model, prepared(model_path, options, folder, context, model::PreparedFor::inspection));
  std::optional<MeasuredCloud> measured;
  {
    const auto timed = folder.stage("read");
    ASBUILT_TRY(read, measured_cloud(cloud_path, model, options, context));
    measured = std::move(read);
  }
  std::optional<inspect::DeviationReport> deviations;
  {
    const auto timed = folder.stage("inspect");
    const inspect::Measurement measurement{measured->cloud, measured->columns.scan, measured->columns.support,
                                           measured->columns.sigma_mm};
    ASBUILT_TRY(found, inspect::inspect(measurement, model.prepared, inputs.options, context));
    deviations = std::move(found);
  }
  {
    const auto timed = folder.stage("report");
    io::RunRecord record = record_of_model(model);
    record.options = recorded_inspection(options);
    report::ReportInput input{folder.command(), folder.arguments, record, model.prepared, *deviations, inputs.options};
    input.points = measured->cloud.size();
    input.measured = measured->file;
    input.tolerance_file = inputs.tolerance_file;
    input.reference_file = inputs.reference_file;
    input.cloud_file = "deviation.ply";
    input.views = options.views;
    input.steps = options.colour_steps;
    const report::ColourMap colours = report::colours_of(input);
    const auto path = folder.file("deviation.ply"), report_folder = folder.file("");
    // The cloud is large and the page takes thought: the one goes to disk while the other is made.
    std::array<Result<void>, 2> written;
    context.arena().run_blocks(written.size(), [&](std::size_t which) {
      written[which] = which == 0 ? write_deviations(path, measured->cloud, deviations->deviation_mm, colours)
                                  : report::write_report(report_folder, input, context);
    });
    for (const Result<void>& result : written) ASBUILT_CHECK(result);
  }
  ASBUILT_CHECK(folder.finish());
  return std::move(*deviations);
}

}  // namespace asbuilt::pipeline
