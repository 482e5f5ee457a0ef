// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/closer_look.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "asbuilt/pipeline/memory_budget.h"
#include "asbuilt/verify/instances.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::pipeline {
namespace {

// Segments are grown within 3 % of the diameter, and the ground as far again tells whether a surface goes on.
constexpr double kReachInDiameters = 0.07;

bool has_part(const verify::Detection& detection) { return !detection.segment.empty(); }

/// The boxes around the placements, in which points are kept.
std::function<bool(const Eigen::Vector3d&)> around(const std::vector<verify::Detection>& placements,
                                                   const io::ScanFile& thinned, const model::PreparedModel& model) {
  std::vector<Pose> poses;
  for (const verify::Detection& detection : placements) {
    if (has_part(detection)) poses.push_back(detection.best.model_from_scan);
  }
  Eigen::AlignedBox3d box = model.box;
  const double reach = kReachInDiameters * model.diameter + 2.0 * thinned.thinning->spacing_mm;
  box.min().array() -= reach;
  box.max().array() += reach;
  return [poses = std::move(poses), box, offset_mm = thinned.offset_mm](const Eigen::Vector3d& point_in_scan) {
    const Eigen::Vector3d local = point_in_scan - offset_mm;
    return std::ranges::any_of(poses, [&](const Pose& pose) { return box.contains(pose * local); });
  };
}

Result<io::ScanFile> read_around(const std::vector<verify::Detection>& placements, const io::ScanFile& thinned,
                                 const model::PreparedModel& model, const Options& options, const Context& context) {
  const std::string path = thinned.path.string();
  io::ReadOptions reading = scan_reading(options, path, context);
  const auto sieve = sieve_for(path, MemoryBudget(options.memory_gb), context);
  sieve->announced = {};  // said already
  sieve->wants = around(placements, thinned, model);
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

}  // namespace

Result<CloserLook> look_closer(const io::ScanFile& thinned, const scan::Viewpoint& viewpoint,
                               std::vector<verify::Detection> placements, const LoadedModel& model,
                               const Options& options, const Context& context) {
  ASBUILT_EXPECT(thinned.thinning.has_value(), "a scan that was thinned");
  CloserLook closer;
  ASBUILT_TRY(file, read_around(placements, thinned, model.prepared, options, context));
  closer.file = std::move(file);
  ASBUILT_TRY(scan, scan::prepare_scan(closer.file.cloud, std::nullopt, {false, viewpoint}, options.scan, context));
  closer.scan = std::move(scan);

  // A thinned scan holds a pose to a fraction of its spacing.
  const double most_mm = 2.0 * thinned.thinning->spacing_mm + 0.01 * model.prepared.diameter;
  for (verify::Detection& detection : placements) {
    if (!has_part(detection)) continue;
    const std::vector<detect::Hypothesis> known{{detection.best.model_from_scan, detection.best.votes}};
    ASBUILT_TRY(again, verify::verify(closer.scan, model.prepared, known, options.verify, context, true));
    const double shift_mm =
        largest_shift_mm(again.best.model_from_scan, detection.best.model_from_scan, model.prepared);
    if (shift_mm > most_mm || again.segment.empty()) {
      return fail(ErrorCode::not_possible,
                  fmt::format("{}: the part found in the thinned scan moves by {:.3g} mm among all points; raise "
                              "--memory, so that it is sought in more of them",
                              thinned.path.string(), shift_mm));
    }
    detection.best.model_from_scan = again.best.model_from_scan;
    detection.best.rms_mm = again.best.rms_mm;
    detection.segment = std::move(again.segment);
    detection.margin_points = std::move(again.margin_points);
  }
  if (placements.size() > 1) verify::separate_segments(placements, closer.scan, model.prepared, context);
  closer.placements = std::move(placements);
  return closer;
}

}  // namespace asbuilt::pipeline
