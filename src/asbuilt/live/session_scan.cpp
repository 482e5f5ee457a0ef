// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>

#include "asbuilt/core/parallel.h"
#include "asbuilt/live/session_implementation.h"

namespace asbuilt::live {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Points that a file may lose without changing what is seen at a first look: no colours, no grid, every n-th point.
io::ScanFile thinned(const io::ScanFile& file, std::size_t wanted) {
  io::ScanFile thin = file;
  thin.colours.clear();
  thin.intensities.clear();
  thin.grid.reset();
  thin.cloud = {};
  const std::size_t stride = std::max<std::size_t>(1, file.cloud.size() / wanted);
  for (std::size_t i = 0; i < file.cloud.size(); i += stride) {
    thin.cloud.positions.push_back(file.cloud.positions[i]);
    if (file.cloud.has_normals()) thin.cloud.normals.push_back(file.cloud.normals[i]);
  }
  return thin;
}

std::optional<Eigen::Vector3d> local_viewpoint(const io::ScanRecord& scan) {
  if (!scan.viewpoint || scan.viewpoint_kind != "point") return std::nullopt;
  return Eigen::Vector3d(*scan.viewpoint - scan.offset);
}

std::optional<SensorLimits> limits_of(const std::vector<io::ScanFile>& files, const std::vector<Entry>& entries) {
  std::vector<SensorLimits> seen;
  for (const Entry& entry : entries) {
    const auto viewpoint = local_viewpoint(entry.record);
    const auto index = static_cast<std::size_t>(entry.record.index_in_file);
    if (!entry.posed || !viewpoint || index >= files.size() || files[index].cloud.empty()) continue;
    seen.push_back(limits_seen(files[index].cloud.positions, entry.posed->part, *viewpoint));
  }
  return seen.empty() ? std::nullopt : std::optional(learnt_limits(seen));
}

bool differ_much(const SensorLimits& a, const SensorLimits& b) {
  const auto apart = [](double x, double y) { return std::abs(x - y) > 0.15 * std::max(x, y); };
  return a.source != b.source || apart(a.half_angle_deg, b.half_angle_deg) || apart(a.distance_mm, b.distance_mm) ||
         apart(a.far_mm, b.far_mm) || apart(a.near_mm, b.near_mm);
}

std::string sound_of(const FileEntries& group) {
  const bool used = std::ranges::any_of(group.entries, &Entry::in_use);
  return used ? "accepted" : "rejected";
}

}  // namespace

void LiveSession::Implementation::learn_sensor() {
  if (options.sensor) return;
  std::vector<SensorLimits> seen;
  for (const auto& [file, group] : files) {
    if (group.limits) seen.push_back(*group.limits);
  }
  if (seen.empty()) return;
  const SensorLimits learnt = learnt_limits(seen);
  if (!differ_much(learnt, planner->limits())) return;
  planner = std::make_unique<ViewPlanner>(surface, model.prepared, learnt, context);
}

std::optional<FileEntries> LiveSession::Implementation::first_look(const pipeline::InputFile& input,
                                                                   const pipeline::ScanHalf& half) {
  FileEntries group;
  group.provisional = true;
  for (const io::ScanFile& file : *input.scans) {
    Context quiet = context;
    quiet.warning = nullptr;
    auto judged = pipeline::judge_scan(thinned(file, options.first_look_points), half, *run, quiet);
    if (!judged) return std::nullopt;
    for (pipeline::JudgedScan& scan : *judged) {
      Entry entry;
      entry.record = std::move(scan.record);
      entry.record.path = input.path;
      entry.record.name = pipeline::entry_name(file.name, entry.record.instance);
      entry.record.sha256 = input.sha256;
      entry.record.index_in_file = file.index_in_file;
      if (scan.segment && entry.record.status == io::ScanStatus::accepted) {
        pipeline::PosedScan posed;
        for (std::size_t i = 0; i < scan.segment->cloud.size(); ++i) {
          if (!scan.segment->is_part[i]) continue;
          posed.part.positions.push_back(scan.segment->cloud.positions[i]);
          posed.part.normals.push_back(scan.segment->cloud.normals[i]);
        }
        posed.model_from_local_detected = *entry.record.model_from_scan * Eigen::Translation3d(entry.record.offset);
        posed.model_from_local_start = posed.model_from_local = posed.model_from_local_detected;
        posed.noise_sigma_mm = entry.record.noise_sigma;
        posed.spacing_mm = entry.record.spacing;
        if (const auto viewpoint = local_viewpoint(entry.record)) {
          posed.viewpoint = {scan::Viewpoint::Kind::point, *viewpoint};
        }
        thin(posed);
        if (!posed.part.empty()) entry.posed = std::move(posed);
      }
      group.entries.push_back(std::move(entry));
    }
  }
  return group;
}

Result<void> LiveSession::add(const std::string& path) {
  Implementation& own = *implementation_;
  const auto begin = Clock::now();
  const std::string file = fs::path(path).filename().string();
  const auto since = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  pipeline::InputFile input = pipeline::read_input(path, own.options.pipeline, own.context);
  if (!input.scans && input.scans.error().code == ErrorCode::cancelled) return tl::unexpected(input.scans.error());

  const auto out = own.store->removed().find(file);
  if (out != own.store->removed().end()) {
    if (out->second == input.sha256) return {};
    ASBUILT_CHECK(own.store->set_removed(file, std::nullopt));  // another content: another scan
  }
  const auto stored = own.store->files().find(file);
  if (stored != own.store->files().end() && !input.sha256.empty()) {
    const auto& scans = stored->second.record.scans;
    const bool same = std::ranges::all_of(
        scans, [&](const io::ScanRecord& scan) { return scan.sha256 == input.sha256 && scan.path == path; });
    if (same && !scans.empty()) return {};
  }
  own.duplicates.erase(file);
  std::string outdone;
  for (const auto& [other, known] : own.store->files()) {
    if (other == file || input.sha256.empty() || known.record.scans.empty()) continue;
    if (known.record.scans.front().sha256 != input.sha256) continue;
    if (other < file) {
      if (stored != own.store->files().end()) {
        ASBUILT_CHECK(own.store->erase(file));
        own.erase(file);
      }
      own.duplicates[file] = other;
      own.duplicate_paths[file] = path;
      own.publish(on_change);
      note("info", file, fmt::format("{} is the same file as {} and counts once", file, other));
      return {};
    }
    outdone = other;
  }

  set_phase("judging", file);
  const pipeline::ScanHalf half = own.shared.half(own.model, own.options.pipeline);
  ASBUILT_TRY(folder, own.store->begin(file));
  const bool large = input.scans && std::ranges::any_of(*input.scans, [&](const io::ScanFile& scan) {
                       return scan.cloud.size() > own.options.first_look_above;
                     });
  bool told = false;
  if (large) {
    try {
      if (auto looked = own.first_look(input, half)) {
        looked->seconds = since();
        const std::string sound = sound_of(*looked);
        own.show(file, std::move(*looked));
        own.publish(on_change, sound);
        told = true;
      }
    } catch (const std::bad_alloc&) {  // the whole will tell
    }
  }

  // Sensor limits want the cloud, which the scan half lets go.
  std::vector<io::ScanFile> outlines;
  if (input.scans) {
    for (const io::ScanFile& scan : *input.scans) outlines.push_back(thinned(scan, 4000));
  }
  std::optional<io::RunRecord> made;
  const auto detect_alone = [&]() -> Result<void> {
    ASBUILT_TRY(detect_run, pipeline::RunFolder::open(folder, "detect", false, own.context.arena().threads()));
    io::RunRecord record = own.shared.empty_record;
    ASBUILT_CHECK(pipeline::take_scans(input, half, detect_run, record, own.context));
    const bool any = std::ranges::any_of(
        record.scans, [](const io::ScanRecord& scan) { return scan.status != io::ScanStatus::failed; });
    record.state = any ? io::RunState::complete : io::RunState::failed;
    ASBUILT_CHECK(detect_run.finish(record));
    made = std::move(record);
    return {};
  };
  FileEntries group;
  const auto take_in = [&]() -> Result<void> {
    ASBUILT_CHECK(detect_alone());
    for (std::size_t i = 0; i < made->scans.size(); ++i) {
      Entry entry;
      entry.record = made->scans[i];
      entry.posed = own.posed(entry.record, folder / io::segment_file(i, entry.record.name));
      group.entries.push_back(std::move(entry));
    }
    group.limits = limits_of(outlines, group.entries);
    return own.store->commit(file, *made, group.limits);
  };
  if (auto taken = take_in(); !taken) {
    if (told && own.files.contains(file)) own.erase(file);
    own.next.phase = "waiting";
    own.next.busy_with.clear();
    own.publish(on_change);
    return taken;
  }
  group.seconds = since();
  const std::string sound = sound_of(group);
  own.show(file, std::move(group));
  if (!outdone.empty()) {
    ASBUILT_CHECK(own.store->erase(outdone));
    own.erase(outdone);
    own.duplicates[outdone] = file;
    own.duplicate_paths[outdone] = (fs::path(path).parent_path() / outdone).string();
    own.latest = file;
  }
  own.next.phase = "waiting";
  own.next.busy_with.clear();
  own.next.refinement = "due";
  own.publish(on_change, told ? std::string() : sound);
  const SensorLimits before = own.planner->limits();
  own.learn_sensor();
  if (!(own.planner->limits() == before)) own.publish(on_change);
  return {};
}

}  // namespace asbuilt::live
