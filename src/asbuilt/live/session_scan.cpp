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

std::optional<Eigen::Vector3d> local_viewpoint(const io::ScanRecord& scan) {
  if (!scan.viewpoint || scan.viewpoint_kind != "point") return std::nullopt;
  return Eigen::Vector3d(*scan.viewpoint - scan.offset);
}

/// Every n-th point.
std::vector<Eigen::Vector3f> outline_of(const PointCloud& cloud) {
  constexpr std::size_t kAbout = 4000;
  const std::size_t stride = std::max<std::size_t>(1, cloud.size() / kAbout);
  std::vector<Eigen::Vector3f> some;
  for (std::size_t i = 0; i < cloud.size(); i += stride) some.push_back(cloud.positions[i]);
  return some;
}

std::optional<SensorLimits> limits_of(const std::vector<std::vector<Eigen::Vector3f>>& outlines,
                                      const std::vector<Entry>& entries, const model::PreparedModel& model) {
  std::vector<SensorLimits> seen;
  for (const Entry& entry : entries) {
    const auto viewpoint = local_viewpoint(entry.record);
    const auto index = static_cast<std::size_t>(entry.record.index_in_file);
    if (!entry.posed || !viewpoint || index >= outlines.size() || outlines[index].empty()) continue;
    const Eigen::Vector3d middle = entry.posed->model_from_local_detected.inverse() * model.box.center().eval();
    seen.push_back(limits_seen(outlines[index], *viewpoint, middle, model.diameter));
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

Result<void> LiveSession::Implementation::add_former_copy_of(const std::string& file, LiveSession& session) {
  for (const auto& [duplicate, original] : duplicates) {
    if (original == file) return session.add(std::string(duplicate_paths[duplicate]));  // takes the others along
  }
  return {};
}

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

std::vector<Entry> LiveSession::Implementation::early_entries(const pipeline::InputFile& input,
                                                              const io::ScanFile& scan,
                                                              std::span<const pipeline::JudgedScan> judged) const {
  std::vector<Entry> entries;
  for (const pipeline::JudgedScan& found : judged) {
    Entry entry;
    entry.record = found.record;
    entry.record.path = input.path;
    entry.record.name = pipeline::entry_name(scan.name, entry.record.instance);
    entry.record.sha256 = input.sha256;
    entry.record.index_in_file = scan.index_in_file;
    if (found.segment && entry.record.status == io::ScanStatus::accepted) {
      pipeline::PosedScan posed;
      for (std::size_t i = 0; i < found.segment->cloud.size(); ++i) {
        if (!found.segment->is_part[i]) continue;
        posed.part.positions.push_back(found.segment->cloud.positions[i]);
        posed.part.normals.push_back(found.segment->cloud.normals[i]);
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
    entries.push_back(std::move(entry));
  }
  return entries;
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
      return own.add_former_copy_of(file, *this);
    }
    outdone = other;
  }

  set_phase("judging", file);
  pipeline::ScanHalf half = own.shared.half(own.model, own.options.pipeline);
  ASBUILT_TRY(folder, own.store->begin(file));
  bool told = false;
  std::optional<FileEntries> before;  // of an earlier content, which stays if this one cannot be stored
  if (const auto known = own.files.find(file); known != own.files.end()) before = known->second;
  std::vector<Entry> found_early;  // of all scans of the file so far
  half.early_verdict = [&](const io::ScanFile& scan, std::span<const pipeline::JudgedScan> judged) {
    std::ranges::move(own.early_entries(input, scan, judged), std::back_inserter(found_early));
    const FileEntries early{found_early, {}, true, since()};
    const std::string sound = sound_of(early);
    own.show(file, early);
    own.publish(on_change, told ? std::string() : sound);
    told = true;
  };

  // Sensor limits want the cloud, which the scan half lets go.
  std::vector<std::vector<Eigen::Vector3f>> outlines;
  if (input.scans) {
    for (const io::ScanFile& scan : *input.scans) outlines.push_back(outline_of(scan.cloud));
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
    group.limits = limits_of(outlines, group.entries, own.model.prepared);
    return own.store->commit(file, *made, group.limits);
  };
  if (auto taken = take_in(); !taken) {
    own.store->abandon();
    if (told) {
      own.erase(file);
      if (before) own.show(file, std::move(*before));
    }
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
  const SensorLimits reckoned_with = own.planner->limits();
  own.learn_sensor();
  if (!(own.planner->limits() == reckoned_with)) own.publish(on_change);
  return own.add_former_copy_of(file, *this);
}

}  // namespace asbuilt::live
