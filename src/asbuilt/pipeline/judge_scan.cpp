// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/judge_scan.h"

#include <fmt/format.h>

#include <algorithm>

#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/pipeline/closer_look.h"
#include "asbuilt/pipeline/find_part.h"
#include "asbuilt/pipeline/search_points.h"
#include "asbuilt/pipeline/unit_check.h"
#include "asbuilt/verify/instances.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::pipeline {
namespace {

/// From coordinates with the offset taken off to those of the file.
Pose for_file(const Pose& model_from_local, const Eigen::Vector3d& offset_mm) {
  return model_from_local * Eigen::Translation3d(-offset_mm);
}
Pose for_local(const Pose& model_from_scan, const Eigen::Vector3d& offset_mm) {
  return model_from_scan * Eigen::Translation3d(offset_mm);
}

/// What the user typed, without a unit, thus in that of the file, becomes a place in the scan's local coordinates.
scan::ViewpointRequest local_request(scan::ViewpointRequest request, const io::ScanFile& file) {
  if (request.stated.kind == scan::Viewpoint::Kind::point) {
    request.stated.value = request.stated.value * io::millimetres_per(file.unit) - file.offset_mm;
  }
  // The origin, which `auto` would try, is kilometres away from points that needed an offset.
  if (!file.offset_mm.isZero(0.0)) request.may_be_origin = false;
  // What was left of a file too large for memory is about as dense everywhere.
  if (file.thinning) request.may_be_sought = false;
  return request;
}

/// `sought`: the points of the file in which the part is sought, or all.
Result<scan::Scan> prepared(const io::ScanFile& file, const PointCloud& sought, const ScanHalf& half,
                            const Context& context) {
  const auto request = local_request(half.viewpoints.of(file.path.string(), file.name), file);
  std::optional<Eigen::Vector3d> file_viewpoint;
  if (file.viewpoint_mm) file_viewpoint = *file.viewpoint_mm - file.offset_mm;
  auto scan = prepare_search(sought, file.cloud, file_viewpoint, request, half.options.scan, context);
  if (scan || scan.error().code == ErrorCode::cancelled) return scan;
  return fail(scan.error().code, fmt::format("{}: {}", file.path.string(), scan.error().message));
}

/// The points in which the part is sought, where there are far more than that takes; without what only measuring needs.
std::optional<io::ScanFile> thinned_for_search(const io::ScanFile& file, const ScanHalf& half, const Context& context) {
  const auto staying = search_points(file.cloud.positions, half.model.prepared, half.options.detect, context);
  if (!staying) return std::nullopt;
  io::ScanFile thin;
  thin.path = file.path;
  thin.name = file.name;
  thin.offset_mm = file.offset_mm;
  thin.viewpoint_mm = file.viewpoint_mm;
  thin.unit = file.unit;
  for (const std::uint32_t i : *staying) {
    thin.cloud.positions.push_back(file.cloud.positions[i]);
    if (file.cloud.has_normals()) thin.cloud.normals.push_back(file.cloud.normals[i]);
  }
  return thin;
}

double spacing_of_all(const PointCloud& cloud, const Context& context) {
  std::vector<Eigen::Vector3f> measured;
  std::ranges::copy_if(cloud.positions, std::back_inserter(measured), is_measured);
  return median_spacing(measured, KdTree(measured, context));
}

std::string_view name_of(scan::ViewpointSource source) {
  switch (source) {
    case scan::ViewpointSource::none:
      return "none";
    case scan::ViewpointSource::stated:
      return "stated";
    case scan::ViewpointSource::file:
      return "file";
    case scan::ViewpointSource::origin:
      return "origin";
    case scan::ViewpointSource::points:
      return "points";
  }
  return "none";
}

void describe_scan(io::ScanRecord& record, const scan::Scan& scan, const io::ScanFile& file) {
  record.points = file.thinning ? file.thinning->points_in_file : scan.cloud.size();
  record.offset = file.offset_mm;
  record.noise_sigma = scan.noise_sigma_mm;
  record.spacing = scan.spacing_mm;
  record.normals_oriented = scan.normals_oriented;
  record.viewpoint_source = name_of(scan.viewpoint_source);
  if (scan.viewpoint.kind == scan::Viewpoint::Kind::point) {
    record.viewpoint = scan.viewpoint.value + file.offset_mm;
    record.viewpoint_kind = "point";
  } else if (scan.viewpoint.kind == scan::Viewpoint::Kind::direction) {
    record.viewpoint = scan.viewpoint.value;
    record.viewpoint_kind = "direction";
  }
  record.warnings = file.notes;
  if (file.thinning) {
    record.warnings.push_back(
        fmt::format("Too large to be kept whole: the part was sought in {} of {} points, one in each cube of {:.3g} "
                    "mm, and measured in all of them around it.",
                    scan.cloud.size(), file.thinning->points_in_file, file.thinning->spacing_mm));
  }
  record.warnings.insert(record.warnings.end(), scan.warnings.begin(), scan.warnings.end());
}

io::CandidateRecord recorded(const verify::Candidate& candidate, const Eigen::Vector3d& offset_mm) {
  io::CandidateRecord record;
  record.model_from_scan = for_file(candidate.model_from_scan, offset_mm);
  record.votes = candidate.votes;
  record.score = candidate.score;
  record.visible_share = candidate.visible_share;
  record.free_space_violations = candidate.free_space_violations;
  record.normal_agreement = candidate.normal_agreement;
  record.rms = candidate.rms_mm;
  record.hidden_share = candidate.hidden_share;
  record.support = candidate.support;
  record.explained_samples = candidate.explained_samples;
  record.facing_share = candidate.facing_share;
  record.found_share = candidate.found_share;
  record.contradiction_share = candidate.contradiction_share;
  record.missing_share = candidate.missing_share;
  record.residual_ratio = candidate.residual_ratio;
  record.weakest_direction = candidate.weakest_direction;
  record.slip_lead = candidate.slip_lead;
  record.size_hold = candidate.size_hold;
  record.size_lead = candidate.size_lead;
  record.lost_end_share = candidate.lost_end_share;
  record.pierced_share = candidate.pierced_share;
  record.overrun_share = candidate.overrun_share;
  record.objection = verify::code_of(candidate.objection);
  return record;
}

void describe_detection(io::ScanRecord& record, const verify::Detection& detection) {
  record.status = detection.status == verify::Status::accepted    ? io::ScanStatus::accepted
                  : detection.status == verify::Status::ambiguous ? io::ScanStatus::ambiguous
                                                                  : io::ScanStatus::rejected;
  record.reason_code = detection.reason == verify::Reason::none ? "" : verify::code_of(detection.reason);
  record.reason = detection.explanation;
  for (const verify::Candidate& candidate : detection.candidates) {
    record.candidates.push_back(recorded(candidate, record.offset));
  }
  if (record.candidates.empty()) return;  // nothing was proposed: no figures
  const verify::Candidate& best = detection.best;
  record.model_from_scan_detected = for_file(best.model_from_scan, record.offset);
  if (detection.status != verify::Status::rejected) record.model_from_scan = record.model_from_scan_detected;
  record.votes = best.votes;
  record.score = best.score;
  record.visible_share = best.visible_share;
  record.free_space_violations = best.free_space_violations;
  record.normal_agreement = best.normal_agreement;
  record.margin = detection.margin;
  record.segment_points = detection.segment.size();
}

/// The starts that the user gave for this scan.
std::vector<Pose> starts_for(const io::ScanFile& file, const std::vector<io::NamedPose>& starts) {
  std::vector<Pose> own;
  for (const io::NamedPose& start : starts) {
    if (!names_scan(start.scan, file.path.string(), file.name)) continue;
    own.push_back(for_local(start.model_from_scan, file.offset_mm));
  }
  return own;
}

/// The candidate that --accept names for a placement of this scan. The scan's name stands for the first placement.
std::optional<int> accepted_candidate(const io::ScanFile& file, std::size_t instance, const Options& options) {
  for (const std::string& text : options.accept) {
    const auto acceptance = parse_acceptance(text);  // validated before
    const bool is_named = acceptance->scan == fmt::format("{}#{}", file.name, instance) ||
                          (instance == 1 && names_scan(acceptance->scan, file.path.string(), file.name));
    if (is_named) return acceptance->candidate;
  }
  return std::nullopt;
}

/// Refuses an --accept for a placement that was not found.
Result<void> check_acceptances(const io::ScanFile& file, std::size_t placements, const Options& options) {
  for (const std::string& text : options.accept) {
    const std::string named = parse_acceptance(text)->scan;
    bool known = !named.starts_with(file.name + "#");
    for (std::size_t i = 1; i <= placements; ++i) known = known || named == fmt::format("{}#{}", file.name, i);
    if (known) continue;
    return fail(ErrorCode::not_possible,
                fmt::format("--accept {}: {} placement(s) of the part were found in {}", text, placements, file.name));
  }
  return {};
}

/// Verifies again with the one candidate that the user vouches for.
Result<verify::Detection> accept_for_user(const verify::Detection& detection, int candidate, const scan::Scan& scan,
                                          const io::ScanFile& file, const ScanHalf& half, const Context& context) {
  const auto index = static_cast<std::size_t>(candidate);
  if (index >= detection.candidates.size()) {
    return fail(ErrorCode::not_possible, fmt::format("--accept {}:{}: the scan has {} candidates, counted from 0",
                                                     file.name, candidate, detection.candidates.size()));
  }
  const verify::Candidate& chosen = detection.candidates[index];
  const std::vector<detect::Hypothesis> hypothesis{{chosen.model_from_scan, chosen.votes}};
  ASBUILT_TRY(accepted, verify::verify(scan, half.model.prepared, hypothesis, half.options.verify, context, true));
  accepted.candidates = detection.candidates;  // the list the user chose from
  return std::move(accepted);
}

/// Puts the candidates that --accept names in the place of what was found.
Result<void> take_acceptances(std::vector<verify::Detection>& placements, const scan::Scan& scan,
                              const io::ScanFile& file, const ScanHalf& half, const Context& context) {
  ASBUILT_CHECK(check_acceptances(file, placements.size(), half.options));
  bool chosen_by_user = false;
  for (std::size_t i = 0; i < placements.size(); ++i) {
    const auto candidate = accepted_candidate(file, i + 1, half.options);
    if (!candidate) continue;
    ASBUILT_TRY(accepted, accept_for_user(placements[i], *candidate, scan, file, half, context));
    placements[i] = std::move(accepted);
    chosen_by_user = true;
  }
  if (chosen_by_user) verify::separate_segments(placements, scan, half.model.prepared, context);
  return {};
}

/// One entry for each placement, with its points of the scan out of which it was cut. `occluders` are those of all that
/// the sensor saw; they are there where a placement has a segment.
std::vector<JudgedScan> entries_of(const io::ScanRecord& of_scan, const std::vector<verify::Detection>& placements,
                                   const scan::Scan& scan, const std::optional<scan::Occluders>& occluders,
                                   const io::ScanFile& file, const ScanHalf& half, const Context& context) {
  std::vector<JudgedScan> entries;
  for (const verify::Detection& detection : placements) {
    JudgedScan entry{of_scan, {}};
    entry.record.instance = static_cast<int>(entries.size()) + 1;
    entry.record.instances_in_scan = static_cast<int>(placements.size());
    describe_detection(entry.record, detection);
    if (accepted_candidate(file, entries.size() + 1, half.options)) entry.record.reason_code = "accepted_by_user";
    if (!detection.segment.empty()) {
      entry.segment = cut_out(scan, file, detection, half.model.prepared, *occluders, context);
    }
    entries.push_back(std::move(entry));
  }
  return entries;
}

}  // namespace

Options with_units_read(const ScanHalf& half, const io::ScanFile& file) {
  Options options = half.options;
  options.scan_unit = file.unit;
  if (options.model_unit == io::Unit::stated) options.model_unit = half.model.unit;
  return options;
}

Result<std::vector<JudgedScan>> judge_scan(const io::ScanFile& file, const ScanHalf& half, RunFolder& folder,
                                           const Context& context) {
  io::ScanRecord record;
  std::optional<io::ScanFile> thin;
  Result<scan::Scan> scan;
  {
    const auto timed = folder.stage("prepare_scan", file.name);
    thin = thinned_for_search(file, half, context);
    scan = prepared(file, thin ? thin->cloud : file.cloud, half, context);
  }
  if (!scan) return tl::unexpected(scan.error());
  describe_scan(record, *scan, file);
  if (!file.thinning && thin) {
    record.points = static_cast<std::size_t>(std::ranges::count_if(file.cloud.positions, is_measured));
  }
  if (const auto contradiction = size_contradiction(*scan, half.model.prepared, with_units_read(half, file))) {
    record.status = io::ScanStatus::rejected;
    record.reason_code = verify::code_of(verify::Reason::scan_too_small);
    record.reason = *contradiction;
    return std::vector<JudgedScan>{{std::move(record), {}}};
  }

  const TimedStage timed = [&](std::string_view stage, const std::function<void()>& work) {
    const auto taken = folder.stage(stage, file.name);
    work();
  };
  ASBUILT_TRY(found, find_part(*scan, half.model.prepared, half.codebook, starts_for(file, half.starts), half.options,
                               timed, context));
  ASBUILT_CHECK(take_acceptances(found.placements, *scan, file, half, context));
  const bool is_found =
      std::ranges::any_of(found.placements, [](const auto& placement) { return !placement.segment.empty(); });
  const bool is_thinned = thin || file.thinning;
  if (thin && !is_found) record.spacing = spacing_of_all(file.cloud, context);  // a closer look would have told
  std::optional<scan::Occluders> occluders;
  if (is_found) occluders.emplace(*scan);
  const auto entries_as_found = [&] {
    return entries_of(record, found.placements, *scan, occluders, thin ? *thin : file, half, context);
  };
  if (!is_thinned || !is_found) return entries_as_found();

  if (half.early_verdict) half.early_verdict(file, entries_as_found());
  const auto taken = folder.stage("look_closer", file.name);
  const double sought_spacing_mm =
      thin ? half.options.detect.search_spacing_ratio * half.model.prepared.sampling_distance
           : file.thinning->spacing_mm;
  const ThinnedSearch search{file, sought_spacing_mm, thin.has_value(), scan->viewpoint, found.sampled};
  *scan = {};  // the memory is wanted for the closer look
  thin.reset();
  ASBUILT_TRY(closer, look_closer(search, std::move(found.placements), half.model, half.options, context));
  if (closer.file.thinning) {
    record.warnings.push_back(
        fmt::format("Even around the part there are more points than fit: one in each cube of {:.3g} mm was "
                    "measured; raise --memory to measure all.",
                    closer.file.thinning->spacing_mm));
  }
  record.noise_sigma = closer.scan.noise_sigma_mm;
  record.spacing = closer.scan.spacing_mm;
  record.normals_oriented = closer.scan.normals_oriented;
  return entries_of(record, closer.placements, closer.scan, occluders, closer.file, half, context);
}

}  // namespace asbuilt::pipeline
