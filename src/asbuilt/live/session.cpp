// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/session.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "asbuilt/core/parallel.h"
#include "asbuilt/live/session_implementation.h"
#include "asbuilt/live/words.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNotes = 50;

Result<void> check_same_session(const ScanStore& store, const io::RunRecord& expected, const fs::path& folder) {
  for (const auto& [file, stored] : store.files()) {
    const bool same_model = stored.record.model.sha256 == expected.model.sha256;
    const bool same_options = stored.record.options == expected.options && stored.record.version == expected.version;
    if (same_model && same_options) continue;
    return fail(ErrorCode::unwritable_output,
                fmt::format("{}: holds a session with {}; choose another --output, or give --force to start anew",
                            folder.string(), same_model ? "other options or of another version" : "another model"));
  }
  return {};
}

}  // namespace

LiveSession::LiveSession(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
LiveSession::~LiveSession() = default;

Result<std::unique_ptr<LiveSession>> LiveSession::open(const std::string& model_path, const LiveOptions& options,
                                                       const fs::path& folder, bool force, const Context& context) {
  ASBUILT_CHECK(options.pipeline.validate());
  auto own = std::make_unique<Implementation>(options, folder, context);
  own->options.pipeline = pipeline::with_paper_mode_applied(options.pipeline);
  ASBUILT_TRY(run, pipeline::RunFolder::open(folder, "live", force, context.arena().threads()));
  ASBUILT_TRY(model, pipeline::load_model(model_path, own->options.pipeline, context));
  own->model = std::move(model);
  ASBUILT_TRY(shared, pipeline::shared_by_scans(own->model, own->options.pipeline, run, context));
  own->shared = std::move(shared);
  ASBUILT_CHECK(run.finish());
  own->run.emplace(std::move(run));
  if (force) {
    std::error_code ignored;
    fs::remove_all(folder / "scans", ignored);
    fs::remove(folder / "live.json", ignored);
  }
  std::vector<std::string> lost;
  ASBUILT_TRY(store, ScanStore::open(folder, lost));
  ASBUILT_CHECK(check_same_session(store, own->shared.empty_record, folder));
  own->store.emplace(std::move(store));
  own->surface = surface_of(own->model.prepared);
  own->planner =
      std::make_unique<ViewPlanner>(own->surface, own->model.prepared,
                                    options.sensor.value_or(assumed_limits(own->model.prepared.diameter)), context);
  LiveState& next = own->next;
  next.model = own->model.record;
  next.box = own->model.prepared.box;
  next.output = folder.string();
  next.total_area_mm2 = own->surface.total_area_mm2;
  next.faces = own->surface.face.empty() ? 0 : 1 + static_cast<int>(std::ranges::max(own->surface.face));
  next.phase = "waiting";
  ASBUILT_TRY(first_builder, graph::PoseGraphBuilder::create(own->model.prepared, own->options.pipeline.graph));
  own->builder = std::move(first_builder);

  // What an earlier session left, in the order in which it came.
  std::vector<const StoredFile*> stored;
  for (const auto& [file, one] : own->store->files()) stored.push_back(&one);
  std::ranges::sort(stored, {}, &StoredFile::order);
  for (const StoredFile* one : stored) {
    FileEntries group;
    group.limits = one->limits;
    for (std::size_t i = 0; i < one->record.scans.size(); ++i) {
      Entry entry;
      entry.record = one->record.scans[i];
      entry.posed = own->posed(entry.record, one->folder / io::segment_file(i, entry.record.name));
      group.entries.push_back(std::move(entry));
    }
    own->show(one->file, std::move(group));
  }
  own->latest.clear();
  for (const std::string& text : lost) next.notes.push_back({0, "warn", "", text + "; its scans are judged again"});
  std::unique_ptr<LiveSession> session(new LiveSession(std::move(own)));
  session->implementation_->shown = std::make_shared<LiveState>();
  session->implementation_->publish(session->on_change);
  return session;
}

Result<void> LiveSession::remove(const std::string& file) {
  Implementation& own = *implementation_;
  own.duplicates.erase(file);
  if (own.store->removed().contains(file)) ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));
  if (own.store->files().contains(file)) {
    ASBUILT_CHECK(own.store->erase(file));
    own.erase(file);
    own.next.refinement = "due";
  }
  own.publish(on_change);
  return own.add_former_copy_of(file, *this);
}

Result<bool> LiveSession::take_out(const std::string& file) {
  Implementation& own = *implementation_;
  const auto stored = own.store->files().find(file);
  if (stored == own.store->files().end()) return false;
  const std::string sha256 = stored->second.record.scans.empty() ? "" : stored->second.record.scans.front().sha256;
  ASBUILT_CHECK(own.store->set_removed(file, sha256));  // first: killed here, it is taken out at the next start
  ASBUILT_CHECK(own.store->erase(file));
  own.erase(file);
  own.next.refinement = "due";
  own.publish(on_change);
  return true;
}

Result<bool> LiveSession::restore(const std::string& file) {
  Implementation& own = *implementation_;
  if (!own.store->removed().contains(file)) return false;
  ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));
  own.publish(on_change);
  return true;
}

Result<void> LiveSession::keep_only(const std::vector<std::string>& present) {
  Implementation& own = *implementation_;
  const std::set<std::string> there(present.begin(), present.end());
  std::vector<std::string> gone;
  for (const auto& [file, stored] : own.store->files()) {
    // Taken out, but killed before its scans went.
    if (!there.contains(file) || own.store->removed().contains(file)) gone.push_back(file);
  }
  for (const std::string& file : gone) {
    ASBUILT_CHECK(own.store->erase(file));
    own.erase(file);
  }
  std::vector<std::string> forgotten;
  for (const auto& [file, sha256] : own.store->removed()) {
    if (!there.contains(file)) forgotten.push_back(file);
  }
  for (const std::string& file : forgotten) ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));
  own.learn_sensor();
  own.publish(on_change);
  return {};
}

std::shared_ptr<const LiveState> LiveSession::state() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->shown;
}

std::shared_ptr<const SurfaceValues> LiveSession::values() const {
  const std::lock_guard lock(implementation_->mutex);
  return implementation_->shown_values;
}

const Surface& LiveSession::surface() const { return implementation_->surface; }

void LiveSession::note(const std::string& level, const std::string& file, const std::string& text) {
  implementation_->publish_light(on_change, [&](LiveState& state) {
    state.notes.push_back({state.revision + 1, level, file, text});
    if (state.notes.size() > kMostNotes) state.notes.erase(state.notes.begin());
  });
}

void LiveSession::set_trouble(const std::string& what, const Trouble& trouble) {
  implementation_->publish_light(on_change, [&](LiveState& state) {
    state.troubles[what] = trouble;
    set_now(state);
  });
}

void LiveSession::end_trouble(const std::string& what) {
  if (!implementation_->next.troubles.contains(what)) return;
  implementation_->publish_light(on_change, [&](LiveState& state) {
    state.troubles.erase(what);
    set_now(state);
  });
}

void LiveSession::set_phase(const std::string& phase, const std::string& busy_with) {
  implementation_->publish_light(on_change, [&](LiveState& state) {
    state.phase = phase;
    state.busy_with = busy_with;
  });
}

void LiveSession::set_watch(const std::string& folder) {
  implementation_->publish_light(on_change, [&](LiveState& state) { state.watch = folder; });
}

}  // namespace asbuilt::live
