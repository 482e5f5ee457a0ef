// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/run_folder.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <ctime>
#include <system_error>
#include <vector>

#include "asbuilt/io/file.h"

namespace asbuilt::pipeline {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) { return std::chrono::duration<double>(Clock::now() - begin).count(); }

std::uint64_t peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

tl::unexpected<Error> unwritable(const fs::path& path, std::string_view why) {
  return fail(ErrorCode::unwritable_output, fmt::format("{}: {}", path.string(), why));
}

/// The command that an existing folder belongs to; empty if it is none of ours.
std::string command_of(const fs::path& folder) {
  const auto timing = io::read_timing_record(folder / "timing.json");
  return timing ? timing->command : std::string();
}

/// Makes the folder with its first file already in it, so that a run killed at any moment is known as ours.
Result<void> create_whole(const fs::path& folder, std::string_view timing_json) {
  std::error_code error;
  const fs::path parent = folder.parent_path();
  if (!parent.empty()) fs::create_directories(parent, error);
  if (error) return unwritable(folder, fmt::format("cannot be made: {}", error.message()));
  const fs::path temporary = fs::path(fmt::format("{}.{}.tmp", folder.string(), ::getpid()));
  fs::create_directory(temporary, error);
  if (error) return unwritable(folder, fmt::format("cannot be made: {}", error.message()));
  auto written = io::write_file(temporary / "timing.json", timing_json);
  if (written) {
    fs::rename(temporary, folder, error);
    if (!error) return {};
    written = unwritable(folder, fmt::format("cannot be made: {}", error.message()));
  }
  std::error_code ignored;
  fs::remove_all(temporary, ignored);
  return written;
}

/// Takes away segments of earlier runs: other scans, or scans in another order.
void remove_stale_segments(const fs::path& folder, const io::RunRecord& record) {
  std::vector<fs::path> stale;
  std::error_code error;
  for (fs::directory_iterator entry(folder / "segments", error), end; !error && entry != end; entry.increment(error)) {
    stale.push_back(fs::path("segments") / entry->path().filename());
  }
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    if (record.scans[i].has_segment()) std::erase(stale, io::segment_file(i, record.scans[i].name));
  }
  for (const fs::path& name : stale) {
    const bool is_ours = name.extension() == ".ply";
    if (is_ours) fs::remove(folder / name, error);
  }
}

fs::path without_trailing_slash(const fs::path& path) {
  return path.has_filename() || !path.has_parent_path() ? path : path.parent_path();
}

}  // namespace

std::string utc_now() { return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr))); }

struct RunFolder::State {
  fs::path path;
  bool made = false;  // by this run
  bool kept = false;  // something of this run is in it
  bool start_anew = false;
  io::TimingRecord timing;
  Clock::time_point begin = Clock::now(), last_checkpoint = Clock::now();
  double checkpoint_seconds = 0.0;
};

RunFolder::RunFolder(std::unique_ptr<State> state) : state_(std::move(state)) {}
RunFolder::RunFolder(RunFolder&&) noexcept = default;
RunFolder& RunFolder::operator=(RunFolder&&) noexcept = default;

RunFolder::~RunFolder() {
  // A run that failed before it had anything to say (say, no readable model) leaves no folder behind.
  if (!state_ || !state_->made || state_->kept) return;
  std::error_code ignored;
  fs::remove(state_->path / "timing.json", ignored);
  fs::remove_all(state_->path / "segments", ignored);
  fs::remove(state_->path, ignored);
}

Result<RunFolder> RunFolder::open(const fs::path& path, std::string_view command, bool force, int threads) {
  auto state = std::make_unique<State>();
  state->path = without_trailing_slash(path);
  state->timing.command = command;
  state->timing.started = utc_now();
  state->timing.threads = threads;
  std::error_code error;
  const fs::file_status present = fs::status(state->path, error);
  if (!fs::exists(present)) {
    if (error && present.type() != fs::file_type::not_found) return unwritable(path, error.message());
    ASBUILT_CHECK(create_whole(state->path, io::to_json(state->timing)));
    state->made = true;
    return RunFolder(std::move(state));
  }
  if (!fs::is_directory(present)) return unwritable(path, "exists and is no folder; choose another --output");
  if (!force && command_of(state->path) != command) {
    return unwritable(path, fmt::format("exists and is not an earlier run of asbuilt {}; choose another --output, or "
                                        "give --force to write into it",
                                        command));
  }
  state->start_anew = force;
  const bool is_ours = !command_of(state->path).empty();
  RunFolder folder(std::move(state));
  ASBUILT_CHECK(folder.write_timing());
  // What it says is no longer true once the new run has begun.
  if (force && is_ours) folder.remove("result.json");
  return folder;
}

fs::path RunFolder::file(const fs::path& name) const { return state_->path / name; }

const std::string& RunFolder::command() const { return state_->timing.command; }

Result<std::optional<io::RunRecord>> RunFolder::earlier_run(const io::ModelRecord& model) const {
  if (state_->made || state_->start_anew) return std::nullopt;
  const fs::path file = state_->path / "result.json";
  if (!fs::exists(file)) return std::nullopt;
  auto record = io::read_run_record(file);
  if (!record) return unwritable(file, fmt::format("{}; give --force to start anew", record.error().message));
  if (record->model.sha256 == model.sha256) return std::optional(std::move(*record));
  return unwritable(state_->path,
                    fmt::format("holds a run with another model ({}); choose another --output, or give --force to "
                                "start anew",
                                record->model.path));
}

Result<void> RunFolder::write_timing() {
  state_->timing.seconds = seconds_since(state_->begin);
  return io::write_file(file("timing.json"), io::to_json(state_->timing));
}

Result<void> RunFolder::checkpoint(const io::RunRecord& record, bool now) {
  if (!now && seconds_since(state_->last_checkpoint) < 20.0 * state_->checkpoint_seconds) return {};
  const Clock::time_point begin = Clock::now();
  state_->kept = true;
  ASBUILT_CHECK(io::write_file(file("result.json"), io::to_json(record)));
  state_->last_checkpoint = Clock::now();
  state_->checkpoint_seconds = seconds_since(begin);
  return {};
}

Result<void> RunFolder::finish() {
  state_->kept = true;
  state_->timing.finished = utc_now();
  return write_timing();
}

void RunFolder::remove(const fs::path& name) const {
  std::error_code ignored;
  fs::remove(file(name), ignored);
}

Result<void> RunFolder::finish(const io::RunRecord& record) {
  remove_stale_segments(state_->path, record);
  ASBUILT_CHECK(finish());
  return io::write_file(file("result.json"), io::to_json(record));
}

RunFolder::Stage::Stage(RunFolder& folder, std::string_view stage, std::string_view scan)
    : folder_(folder), stage_(stage), scan_(scan), begin_(Clock::now()) {
  if (folder_.on_stage) folder_.on_stage(stage_, scan_);
}

RunFolder::Stage::~Stage() {
  folder_.state_->timing.stages.push_back({stage_, scan_, seconds_since(begin_), peak_memory_bytes()});
}

}  // namespace asbuilt::pipeline
