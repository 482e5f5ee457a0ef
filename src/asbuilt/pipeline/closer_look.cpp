// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/closer_look.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>
#include <utility>

#include "asbuilt/core/parallel.h"
#include "asbuilt/pipeline/memory_budget.h"
#include "asbuilt/verify/instances.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::pipeline {
namespace {

// Segments are grown within 3 % of the diameter, and the ground as far again tells whether a surface goes on.
constexpr double kReachInDiameters = 0.07;

bool has_part(const verify::Detection& detection) { return !detection.segment.empty(); }

/// Tells, of a place in the scan frame without the file's offset, whether it lies in a box around a placement.
std::function<bool(const Eigen::Vector3d&)> around(const std::vector<verify::Detection>& placements, double spacing_mm,
                                                   const model::PreparedModel& model) {
  std::vector<Pose> poses;
  for (const verify::Detection& detection : placements) {
    if (has_part(detection)) poses.push_back(detection.best.model_from_scan);
  }
  Eigen::AlignedBox3d box = model.box;
  const double reach = kReachInDiameters * model.diameter + 2.0 * spacing_mm;
  box.min().array() -= reach;
  box.max().array() += reach;
  return [poses = std::move(poses), box](const Eigen::Vector3d& point_in_scan) {
    return std::ranges::any_of(poses, [&](const Pose& pose) { return box.contains(pose * point_in_scan); });
  };
}

/// The points of a scan that are wanted, with all that the file says of them.
io::ScanFile kept(const io::ScanFile& file, const std::function<bool(const Eigen::Vector3d&)>& wants,
                  const Context& context) {
  std::vector<std::uint8_t> is_wanted(file.cloud.size());
  parallel_for(context, is_wanted.size(), 4096,
               [&](std::size_t i) { is_wanted[i] = wants(file.cloud.positions[i].cast<double>()) ? 1 : 0; });
  const auto wanted_of = [&](const auto& values) {
    std::decay_t<decltype(values)> wanted;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (is_wanted[i] != 0) wanted.push_back(values[i]);
    }
    return wanted;
  };
  io::ScanFile rest;
  rest.path = file.path;
  rest.name = file.name;
  rest.offset_mm = file.offset_mm;
  rest.cloud = {wanted_of(file.cloud.positions), wanted_of(file.cloud.normals)};
  rest.colours = wanted_of(file.colours);
  rest.intensities = wanted_of(file.intensities);
  return rest;
}

/// The same for a scan of which not all points are in memory.
Result<io::ScanFile> read_kept(const io::ScanFile& thinned, const std::function<bool(const Eigen::Vector3d&)>& wants,
                               const Options& options, const Context& context) {
  const std::string path = thinned.path.string();
  io::ReadOptions reading = scan_reading(options, path, context);
  const auto sieve = sieve_for(path, MemoryBudget(options.memory_gb), context);
  sieve->announced = {};  // said already
  sieve->wants = [&](const Eigen::Vector3d& point_in_file) { return wants(point_in_file - thinned.offset_mm); };
  reading.sieve = sieve;
  ASBUILT_TRY(files, io::read_scans(path, reading));
  if (context.cancelled()) return fail(ErrorCode::cancelled, "stopped while reading a scan once more");
  const auto index = static_cast<std::size_t>(thinned.index_in_file);
  if (index >= files.size() || files[index].offset_mm != thinned.offset_mm) {
    return fail(ErrorCode::unreadable_input, fmt::format("{}: the file was changed while it was worked on", path));
  }
  return std::move(files[index]);
}

/// How far a motion moves the model's box at most.
double largest_shift_mm(const Pose& a, const Pose& b, const model::PreparedModel& model) {
  double largest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d in_model = model.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    largest = std::max(largest, (a * b.inverse() * in_model - in_model).norm());
  }
  return largest;
}

/// Registers a placement to the points around it, and cuts it out.
Result<void> register_again(verify::Detection& detection, const ThinnedSearch& search, const scan::Scan& scan,
                            const LoadedModel& model, const Options& options, const Context& context) {
  const std::vector<detect::Hypothesis> known{{detection.best.model_from_scan, detection.best.votes}};
  ASBUILT_TRY(again, verify::verify(scan, model.prepared, known, options.verify, context, true, {}, &search.sampled));
  const double shift_mm = largest_shift_mm(again.best.model_from_scan, detection.best.model_from_scan, model.prepared);
  // A thinned scan holds a pose to a fraction of its spacing.
  const double most_mm = 2.0 * search.spacing_mm + 0.01 * model.prepared.diameter;
  if (shift_mm > most_mm || again.segment.empty()) {
    return fail(ErrorCode::not_possible,
                fmt::format("{}: the part found in the thinned scan moves by {:.3g} mm among all points; raise "
                            "--memory, so that it is sought in more of them",
                            search.file.path.string(), shift_mm));
  }
  detection.best.model_from_scan = again.best.model_from_scan;
  detection.best.rms_mm = again.best.rms_mm;
  detection.segment = std::move(again.segment);
  detection.margin_points = std::move(again.margin_points);
  return {};
}

}  // namespace

Result<CloserLook> look_closer(const ThinnedSearch& search, std::vector<verify::Detection> placements,
                               const LoadedModel& model, const Options& options, const Context& context) {
  CloserLook closer;
  const auto wants = around(placements, search.spacing_mm, model.prepared);
  if (search.file.thinning) {
    ASBUILT_TRY(file, read_kept(search.file, wants, options, context));
    closer.file = std::move(file);
  } else {
    closer.file = kept(search.file, wants, context);
  }
  ASBUILT_TRY(scan,
              scan::prepare_scan(closer.file.cloud, std::nullopt, {false, search.viewpoint}, options.scan, context));
  closer.scan = std::move(scan);
  for (verify::Detection& detection : placements) {
    if (!has_part(detection)) continue;
    if (search.poses_are_final) {
      verify::Segment segment = verify::part_at(detection.best.model_from_scan, closer.scan, model.prepared,
                                                options.verify, search.sampled, context);
      detection.segment = std::move(segment.part);
      detection.margin_points = std::move(segment.margin);
    } else {
      ASBUILT_CHECK(register_again(detection, search, closer.scan, model, options, context));
    }
  }
  if (context.cancelled()) return fail(ErrorCode::cancelled, "stopped while cutting the part out");
  if (placements.size() > 1) verify::separate_segments(placements, closer.scan, model.prepared, context);
  closer.placements = std::move(placements);
  return closer;
}

}  // namespace asbuilt::pipeline
