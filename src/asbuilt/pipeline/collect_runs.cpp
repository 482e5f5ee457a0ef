// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/collect_runs.h"

#include <fmt/format.h>

#include <algorithm>

#include "asbuilt/io/file.h"
#include "asbuilt/pipeline/as_detected.h"
#include "asbuilt/pipeline/scan_hints.h"

namespace asbuilt::pipeline {
namespace {

namespace fs = std::filesystem;

Result<io::RunRecord> read_run(const std::string& folder) {
  ASBUILT_TRY(record, io::read_run_record(fs::path(folder) / "result.json"));
  if (record.state != io::RunState::partial) return std::move(record);
  return fail(
      ErrorCode::unreadable_input,
      fmt::format("{}: the run is not finished ({} scans so far); give its command again, it goes on from there",
                  folder, record.scans.size()));
}

/// Only what the scan half decided: a `reconstruct` folder carries joint options too.
io::Options scan_half_of(const io::Options& options) {
  const io::Options known = recorded(Options{}, {Half::model, Half::scan});
  io::Options kept;
  for (const auto& option : options) {
    const bool of_scan_half = std::ranges::find(known, option.first, &io::Options::value_type::first) != known.end();
    if (of_scan_half || option.first.ends_with("_sha256")) kept.push_back(option);
  }
  return kept;
}

Result<void> copy_segment(const fs::path& from, const fs::path& to) {
  ASBUILT_TRY(content, io::read_file(from));
  std::error_code error;
  fs::create_directories(to.parent_path(), error);
  return io::write_file(to, content);  // says what is wrong, should the folder not be there
}

std::vector<io::ScanRecord*> scans_named(const std::string& typed, io::RunRecord& record) {
  std::vector<io::ScanRecord*> named;
  for (io::ScanRecord& scan : record.scans) {
    if (names_entry(typed, scan)) named.push_back(&scan);
  }
  return named;
}

Result<void> exclude(const std::string& typed, io::RunRecord& record) {
  const auto named = scans_named(typed, record);
  if (named.empty()) {
    return fail(ErrorCode::invalid_argument, fmt::format("--exclude {}: none of the scans has this name", typed));
  }
  for (io::ScanRecord* scan : named) {
    scan->status = io::ScanStatus::rejected;
    scan->reason_code = "excluded";
    scan->reason = "left out by --exclude";
    scan->model_from_scan.reset();
  }
  return {};
}

Result<void> accept(const std::string& text, io::RunRecord& record) {
  ASBUILT_TRY(acceptance, parse_acceptance(text));
  auto named = scans_named(acceptance.scan, record);
  // Among several placements of a scan its name stands for the first, as `explain` prints it.
  if (named.size() > 1) std::erase_if(named, [&](const io::ScanRecord* scan) { return scan->instance > 1; });
  if (named.size() != 1) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("--accept {}: {} scans have this name, expected one", text, named.size()));
  }
  io::ScanRecord& scan = *named.front();
  const auto candidate = static_cast<std::size_t>(acceptance.candidate);
  if (candidate >= scan.candidates.size()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("--accept {}: the scan has {} candidates, counted from 0", text, scan.candidates.size()));
  }
  // The part was cut out under the best pose; another pose of a symmetric part covers the same points, any other does
  // not.
  const bool same_points = candidate == 0 || scan.reason_code == "ambiguous_pose";
  if (!scan.has_segment() || !same_points) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("--accept {}: the part was not cut out of this scan at that pose; give the option to "
                            "asbuilt detect or reconstruct instead",
                            text));
  }
  scan.status = io::ScanStatus::accepted;
  scan.reason_code = "accepted_by_user";
  scan.model_from_scan = scan.candidates[candidate].model_from_scan;
  return {};
}

}  // namespace

Result<io::RunRecord> collect_runs(std::span<const std::string> run_folders, const Options& options,
                                   const RunFolder& folder) {
  io::RunRecord all;
  for (const std::string& path : run_folders) {
    ASBUILT_TRY(run, read_run(path));
    if (all.model.sha256.empty()) {
      all.version = run.version;
      all.model = run.model;
      all.options = scan_half_of(run.options);
    }
    if (run.model.sha256 != all.model.sha256) {
      return fail(
          ErrorCode::invalid_argument,
          fmt::format("{}: was made with another model ({}, sha256 {:.12}...) than {} ({}, sha256 {:.12}...); "
                      "register runs with the same model only",
                      path, run.model.path, run.model.sha256, run_folders.front(), all.model.path, all.model.sha256));
    }
    for (std::size_t i = 0; i < run.scans.size(); ++i) {
      io::ScanRecord scan = as_detected(std::move(run.scans[i]));
      if (scan.has_segment()) {
        ASBUILT_CHECK(copy_segment(fs::path(path) / io::segment_file(i, scan.name),
                                   folder.file(io::segment_file(all.scans.size(), scan.name))));
      }
      all.scans.push_back(std::move(scan));
    }
  }
  for (const std::string& typed : options.exclude) ASBUILT_CHECK(exclude(typed, all));
  for (const std::string& text : options.accept) ASBUILT_CHECK(accept(text, all));
  return all;
}

Result<Options> joint_options(const Options& chosen, const io::RunRecord& runs) {
  Options options = chosen;
  ASBUILT_CHECK(take_over(options, runs.options));
  options.paper_mode = options.paper_mode || chosen.paper_mode;
  return with_paper_mode_applied(options);
}

io::Options choices_about_scans(const Options& chosen) {
  io::Options choices;
  if (!chosen.exclude.empty()) choices.emplace_back("joint_exclude", chosen.exclude);
  if (!chosen.accept.empty()) choices.emplace_back("joint_accept", chosen.accept);
  return choices;
}

Result<void> check_same_model(const LoadedModel& model, const io::RunRecord& runs) {
  if (model.record.sha256 == runs.model.sha256) return {};
  return fail(
      ErrorCode::unreadable_input,
      fmt::format("{}: is not the model of the runs (sha256 {:.12}..., theirs {:.12}...); it has changed since, "
                  "or --model names another",
                  model.record.path, model.record.sha256, runs.model.sha256));
}

}  // namespace asbuilt::pipeline
