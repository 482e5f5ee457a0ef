// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/scan_half.h"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <utility>

#include "asbuilt/core/median.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/as_detected.h"
#include "asbuilt/pipeline/judge_scan.h"
#include "asbuilt/pipeline/memory_budget.h"
#include "asbuilt/pipeline/pipeline_version.h"
#include "asbuilt/pipeline/scan_hints.h"
#include "asbuilt/pipeline/unit_check.h"

namespace asbuilt::pipeline {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kScansTriedWithOtherUnits = 2;

io::ScanRecord failed_record(const std::string& path, std::string name, const Error& error) {
  io::ScanRecord record;
  record.path = path;
  record.name = std::move(name);
  record.status = io::ScanStatus::failed;
  record.reason_code = error.code == ErrorCode::unreadable_input ? "unreadable" : "not_possible";
  record.reason = error.message;
  return record;
}

bool is_left_out(const io::ScanRecord& entry, const Options& options) {
  return std::ranges::any_of(options.exclude, [&](const std::string& typed) { return names_entry(typed, entry); });
}

bool is_excluded(const std::string& path, const std::string& name, const Options& options) {
  return std::ranges::any_of(options.exclude, [&](const std::string& typed) { return names_scan(typed, path, name); });
}

constexpr const char* kLeftOut = "left out by --exclude";

io::ScanRecord excluded_record(const io::ScanFile& file, const std::string& path) {
  io::ScanRecord record;
  record.path = path;
  record.name = file.name;
  record.points = file.cloud.size();
  record.status = io::ScanStatus::rejected;
  record.reason_code = "excluded";
  record.reason = kLeftOut;
  return record;
}

/// Leaves single placements out, which only judging the scan could tell.
void leave_out(JudgedScan& entry) {
  entry.record.status = io::ScanStatus::rejected;
  entry.record.reason_code = "excluded";
  entry.record.reason = kLeftOut;
  entry.record.model_from_scan.reset();
  entry.record.segment_points = 0;
  entry.segment.reset();
}

/// The same options as far as the scan half is concerned, apart from those that name single scans.
bool same_for_scans(const io::Options& a, const io::Options& b) {
  const auto value = [](const io::Options& options, const std::string& name) {
    const auto found = std::ranges::find(options, name, &io::Options::value_type::first);
    return found == options.end() ? std::optional<io::OptionValue>() : std::optional(found->second);
  };
  return std::ranges::all_of(a, [&](const auto& option) {
    return option.first == "exclude" || option.first == "accept" || value(b, option.first) == option.second;
  });
}

/// What an earlier run left, as far as it may stand.
class FinishedScans {
 public:
  FinishedScans(std::optional<io::RunRecord> earlier, const io::Options& options, const RunFolder& folder)
      : folder_(folder) {
    if (earlier && earlier->version == kVersion && same_for_scans(options, earlier->options)) {
      earlier_ = std::move(earlier);
    }
  }

  /// The finished entries of the scan whose first entry now has this index: all of them, or none.
  [[nodiscard]] std::vector<io::ScanRecord> find(std::size_t index, const std::string& path, const std::string& sha256,
                                                 int index_in_file, const Options& options) const {
    std::vector<io::ScanRecord> entries;
    if (!earlier_) return entries;
    for (std::size_t i = index; i < earlier_->scans.size(); ++i) {
      const io::ScanRecord& scan = earlier_->scans[i];
      const bool same = scan.path == path && scan.sha256 == sha256 && scan.index_in_file == index_in_file &&
                        scan.instance == static_cast<int>(entries.size()) + 1;
      if (!same || !stands(scan, i, options)) break;
      entries.push_back(scan);
    }
    const bool complete = !entries.empty() && entries.size() == static_cast<std::size_t>(entries[0].instances_in_scan);
    if (!complete) entries.clear();
    return entries;
  }

 private:
  [[nodiscard]] bool stands(const io::ScanRecord& scan, std::size_t index, const Options& options) const {
    // The joint half rewrote these; their own reasons are gone. A failure may have gone away.
    const auto redone = {io::ScanStatus::failed, io::ScanStatus::dropped, io::ScanStatus::disconnected};
    if (std::ranges::find(redone, scan.status) != redone.end()) return false;
    const bool named = scan.reason_code == "excluded" || scan.reason_code == "accepted_by_user" ||
                       is_left_out(scan, options) || !options.accept.empty();
    if (named) return false;
    return !scan.has_segment() || fs::exists(folder_.file(io::segment_file(index, scan.name)));
  }

  std::optional<io::RunRecord> earlier_;
  const RunFolder& folder_;
};

Result<void> check_names(std::span<const std::string> scan_paths, const Options& options) {
  const auto known = [&](const std::string& typed) {
    // A file with several scans names them NAME_NN, several placements are NAME#N, which only the work itself tells.
    return std::ranges::any_of(scan_paths, [&](const std::string& path) {
      const std::string stem = fs::path(path).stem().string();
      return names_scan(typed, path, stem) || typed.starts_with(stem + "_") || typed.starts_with(stem + "#");
    });
  };
  for (const std::string& typed : options.exclude) {
    if (known(typed)) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("--exclude {}: none of the scans has this name", typed));
  }
  for (const std::string& text : options.scan_units) {
    ASBUILT_TRY(own, parse_unit_of_scan(text));
    const bool is_there = std::ranges::any_of(scan_paths, [&](const std::string& path) {
      return names_scan(own.scan, path, fs::path(path).stem().string());
    });
    if (is_there) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("--scan-unit {}: none of the scans has this name", text));
  }
  for (const std::string& text : options.accept) {
    ASBUILT_TRY(acceptance, parse_acceptance(text));
    if (known(acceptance.scan)) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("--accept {}: none of the scans has this name", text));
  }
  return {};
}

/// Files that steer detection are inputs like any other: another content is another run.
Result<void> add_hashes(io::Options& record, const Options& options) {
  for (const auto& [name, path] :
       {std::pair("poses_sha256", options.poses), std::pair("viewpoint_sha256", options.viewpoint)}) {
    std::error_code ignored;
    if (path.empty() || !fs::is_regular_file(path, ignored)) continue;
    ASBUILT_TRY(content, io::read_file(path));
    record.emplace_back(name, io::sha256(content));
  }
  return {};
}

/// Goes through the files of a run and fills its record.
class ScanHalfRun {
 public:
  ScanHalfRun(const ScanHalf& half, FinishedScans finished, io::RunRecord& record, RunFolder& folder,
              const Context& context)
      : half_(half), finished_(std::move(finished)), record_(record), folder_(folder), context_(context) {}

  [[nodiscard]] Result<void> take(const std::string& path) {
    InputFile input = [&] {
      const auto timed = folder_.stage("read", fs::path(path).stem().string());
      return read_input(path, half_.options, context_);
    }();
    if (!input.scans && input.scans.error().code == ErrorCode::cancelled) return tl::unexpected(input.scans.error());
    return take(input);
  }

  [[nodiscard]] Result<void> take(InputFile& input) {
    const std::string& path = input.path;
    if (!input.scans) {
      context_.warn(input.scans.error().message);
      auto record = failed_record(path, fs::path(path).stem().string(), input.scans.error());
      record.sha256 = input.sha256;
      return add(std::move(record));
    }
    for (io::ScanFile& file : *input.scans) {
      if (context_.cancelled()) return fail(ErrorCode::cancelled, "interrupted");
      std::vector<io::ScanRecord> entries =
          finished_.find(record_.scans.size(), path, input.sha256, file.index_in_file, half_.options);
      if (entries.empty()) {
        ASBUILT_TRY(judged, judge(file, path));
        entries = std::move(judged);
      } else {
        for (io::ScanRecord& entry : entries) entry = as_detected(std::move(entry));
      }
      file.cloud = {};  // one scan at a time
      for (io::ScanRecord& entry : entries) {
        entry.path = path;
        entry.name = entry_name(file.name, entry.instance);
        entry.sha256 = input.sha256;
        entry.index_in_file = file.index_in_file;
        entry.scans_in_file = static_cast<int>(input.scans->size());
        record_.scans.push_back(std::move(entry));
      }
      ASBUILT_CHECK(folder_.checkpoint(record_));
    }
    return {};
  }

 private:
  Result<void> add(io::ScanRecord record) {
    record_.scans.push_back(std::move(record));
    return folder_.checkpoint(record_);
  }

  /// The entries of one scan; an error only if the whole run must stop.
  Result<std::vector<io::ScanRecord>> judge(const io::ScanFile& file, const std::string& path) {
    using Entries = std::vector<io::ScanRecord>;
    if (is_excluded(path, file.name, half_.options)) return Entries{excluded_record(file, path)};
    auto judged = judged_in_bounded_memory(file);
    if (!judged) {
      if (judged.error().code == ErrorCode::cancelled) return tl::unexpected(judged.error());
      context_.warn(judged.error().message);
      return Entries{failed_record(path, file.name, judged.error())};
    }
    for (const std::string& warning : judged->front().record.warnings) {
      context_.warn(fmt::format("{}: {}", path, warning));
    }
    Entries entries;
    for (JudgedScan& entry : *judged) {
      entry.record.path = path;
      entry.record.name = entry_name(file.name, entry.record.instance);
      if (is_left_out(entry.record, half_.options)) leave_out(entry);
      if (entry.segment) ASBUILT_CHECK(write(entry, record_.scans.size() + entries.size()));
      entries.push_back(std::move(entry.record));
    }
    return entries;
  }

  Result<std::vector<JudgedScan>> judged_in_bounded_memory(const io::ScanFile& file) {
    try {
      return judge_scan(file, half_, folder_, context_);
    } catch (const std::bad_alloc&) {
      return fail(ErrorCode::not_possible, fmt::format("{}: {} points do not fit into the memory of this machine",
                                                       file.path.string(), file.cloud.size()));
    }
  }

  Result<void> write(const JudgedScan& judged, std::size_t index) {
    const auto timed = folder_.stage("write_segment", judged.record.name);
    const fs::path path = folder_.file(io::segment_file(index, judged.record.name));
    std::error_code error;
    fs::create_directories(path.parent_path(), error);
    if (error) {
      return fail(ErrorCode::unwritable_output,
                  fmt::format("{}: cannot be made: {}", path.parent_path().string(), error.message()));
    }
    return write_segment(path, *judged.segment, judged.record.offset);
  }

  const ScanHalf& half_;
  FinishedScans finished_;
  io::RunRecord& record_;
  RunFolder& folder_;
  const Context& context_;
};

/// Median spacing of the scans in which the part was found; 0 where it was found in none.
double spacing_of_found(const io::RunRecord& record) {
  std::vector<double> spacings;
  for (const io::ScanRecord& scan : record.scans) {
    const bool found = scan.status == io::ScanStatus::accepted || scan.status == io::ScanStatus::ambiguous;
    if (found && scan.spacing > 0.0) spacings.push_back(scan.spacing);
  }
  return spacings.empty() ? 0.0 : median_of(std::move(spacings));
}

}  // namespace

InputFile read_input(const std::string& path, const Options& options, const Context& context) {
  const auto content = io::FileContent::open(path);
  if (!content) return {path, "", tl::unexpected(content.error())};
  io::ReadOptions reading = scan_reading(options, path, context);
  reading.sieve = sieve_for(path, MemoryBudget(options.memory_gb), context);
  InputFile input{path, io::sha256(content->view()), io::scans_in(path, content->view(), reading)};
  if (const auto whole = content->whole(); !whole) input.scans = tl::unexpected(whole.error());
  if (context.cancelled()) input.scans = fail(ErrorCode::cancelled, "interrupted");
  return input;
}

ScanHalf SharedByScans::half(const LoadedModel& model, const Options& options) const {
  return {model, *codebook, options, viewpoints, starts};
}

Result<SharedByScans> shared_by_scans(const LoadedModel& model, const Options& options, RunFolder& folder,
                                      const Context& context) {
  SharedByScans shared;
  ASBUILT_TRY(viewpoints, Viewpoints::from_text(options.viewpoint, io::Unit::stated));
  shared.viewpoints = std::move(viewpoints);
  if (!options.poses.empty()) {
    ASBUILT_TRY(read, io::read_poses(options.poses, io::Unit::millimetre));
    shared.starts = std::move(read);
  }
  shared.empty_record.version = kVersion;
  shared.empty_record.options = recorded(options, {Half::model, Half::scan});
  ASBUILT_CHECK(add_hashes(shared.empty_record.options, options));
  shared.empty_record.model = model.record;
  const auto timed = folder.stage("codebook");
  ASBUILT_TRY(codebook, detect::build_codebook(model.prepared, options.detect, context));
  shared.codebook = std::move(codebook);
  return shared;
}

Result<void> take_scans(InputFile& input, const ScanHalf& half, RunFolder& folder, io::RunRecord& record,
                        const Context& context) {
  ScanHalfRun run(half, FinishedScans({}, record.options, folder), record, folder, context);
  return run.take(input);
}

void look_for_mistaken_unit(io::RunRecord& record, const ScanHalf& half, RunFolder& folder, const Context& context) {
  constexpr double kFarOff = 5.0;
  const double usual_spacing = spacing_of_found(record);
  std::size_t tried = 0;
  for (io::ScanRecord& scan : record.scans) {
    const double ratio = usual_spacing > 0.0 ? scan.spacing / usual_spacing : 0.0;
    if (usual_spacing > 0.0 && ratio > 1.0 / kFarOff && ratio < kFarOff) continue;
    if (scan.status != io::ScanStatus::rejected || scan.points == 0 || scan.reason_code == "excluded") continue;
    if (scan.reason_code == "scan_too_small" || scan.reason_code == "wrong_unit") continue;
    if (tried++ == kScansTriedWithOtherUnits || context.cancelled()) return;
    const auto timed = folder.stage("try_units", scan.name);
    io::ReadOptions reading = scan_reading(half.options, scan.path, context);
    const auto sieve = sieve_for(scan.path, MemoryBudget(half.options.memory_gb), context);
    sieve->announced = {};  // said when it was read first
    reading.sieve = sieve;
    const auto files = io::read_scans(scan.path, reading);
    if (!files || static_cast<std::size_t>(scan.index_in_file) >= files->size()) continue;
    const io::ScanFile& file = (*files)[static_cast<std::size_t>(scan.index_in_file)];
    const auto factor = factor_that_finds_the_part(file, half.model.prepared, half.codebook, half.options, context);
    if (!factor) continue;
    scan.reason_code = verify::code_of(verify::Reason::wrong_unit);
    // Where the part was found in other scans, the flag must be for this one alone.
    scan.reason = fmt::format(
        "the part is not there at this size, but it is when the scan is {:g} times as large: try {}", *factor,
        flag_for_factor(*factor, with_units_read(half, file),
                        usual_spacing > 0.0 ? fs::path(scan.path).filename().string() : std::string()));
    if (usual_spacing == 0.0) return;
  }
}

Result<io::RunRecord> detect_scans(const LoadedModel& model, std::span<const std::string> scan_paths,
                                   const Options& options, RunFolder& folder, const Context& context) {
  ASBUILT_CHECK(check_names(scan_paths, options));
  ASBUILT_TRY(earlier, folder.earlier_run(model.record));
  ASBUILT_TRY(shared, shared_by_scans(model, options, folder, context));

  io::RunRecord record = shared.empty_record;
  const ScanHalf half = shared.half(model, options);
  ScanHalfRun run(half, FinishedScans(std::move(earlier), record.options, folder), record, folder, context);
  for (std::size_t i = 0; i < scan_paths.size(); ++i) {
    if (context.cancelled()) break;
    if (auto taken = run.take(scan_paths[i]); !taken) {
      if (taken.error().code == ErrorCode::cancelled) break;
      return tl::unexpected(taken.error());
    }
    context.report_progress(static_cast<double>(i + 1) / static_cast<double>(scan_paths.size()));
  }
  if (!context.cancelled()) look_for_mistaken_unit(record, half, folder, context);
  ASBUILT_CHECK(folder.checkpoint(record, true));
  if (context.cancelled()) return fail(ErrorCode::cancelled, "interrupted; the same command goes on from here");
  return record;
}

}  // namespace asbuilt::pipeline
