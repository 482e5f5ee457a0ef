// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/evaluate/pose_error.h"
#include "asbuilt/evaluate/truth.h"
#include "asbuilt/io/run_record.h"

namespace asbuilt::evaluate {

struct EvaluateOptions {
  double right_ratio = 0.02;  ///< a pose is right up to this largest vertex displacement / diameter (our contract)

  [[nodiscard]] Result<void> validate() const;  ///< 0 < right_ratio < 1
};

template <class Visitor>
void for_each_field(EvaluateOptions& options, Visitor&& field) {
  field("right_ratio", options.right_ratio, "largest vertex displacement / diameter of a right pose");
}

/// One scan of the truth and what the result says about it; where the result tells of several placements of the part
/// in the scan (`--instances all`), one of them.
struct ScanFigures {
  std::string name;                ///< file name; "#2", "#3" ... are added for further placements
  std::string status = "missing";  ///< that of result.json, or "missing" if the result does not know the scan
  bool present = false;            ///< the part is there
  bool accepted = false;
  bool right = false;                                       ///< accepted, present, and the pose within tolerance
  std::optional<PoseError> error;                           ///< of the pose in the result, wherever there are both
  std::optional<double> segment_precision, segment_recall;  ///< where there are labels and a segment
  double occlusion = 0.0, hidden = 0.0, clutter = 0.0;      ///< from the truth
};

/// The figures of a run.
struct Evaluation {
  double diameter_mm = 0.0, noise_sigma_mm = 0.0;
  std::size_t scans = 0;  ///< of the truth
  std::size_t present = 0, accepted = 0, right = 0, wrong = 0, disconnected_right = 0;
  std::optional<double> recall;            ///< right / present
  std::optional<double> precision;         ///< right / accepted
  std::size_t part_points = 0;             ///< truly labelled part points of the accepted scans
  std::optional<double> mean_distance_mm;  ///< of these to the true surface, our poses, after their best common motion
  std::optional<double> oracle_distance_mm;  ///< the same under the true poses
  std::optional<double> ratio_to_oracle;
  std::optional<double> relative_pose_error_mm;     ///< RMS of |G T_ours p - T_true p| over these points, one best G
  std::optional<double> relative_pose_error_sigma;  ///< the same / noise sigma

  // Of reconstruction.ply, where there is one; after the motion under which mean_distance_mm is taken.
  std::optional<double> reconstruction_distance_mm;  ///< mean distance of its points to the true as-built surface
  std::size_t reconstruction_points = 0;
  std::size_t reconstruction_beyond = 0;              ///< further than 6 sigma from the true as-built surface
  std::optional<double> reconstruction_beyond_share;  ///< of the points
  std::optional<double> oracle_beyond_share;          ///< the same of the truly labelled points under the true poses
  std::optional<double> reconstruction_completeness;  ///< share of the area that all scans' true points cover

  std::vector<ScanFigures> per_scan;  ///< in the order of the truth
};

/// Compares the result.json of `result_folder` with the truth (truth.json or its folder). Scans are matched by file
/// name, several placements in one scan by the smallest displacement, each at most once. Definitions: docs/evaluate.md.
/// Cost: a few seconds for ten scans. Errors: unreadable_input; not_possible when no scan of the result is in the
/// truth, or two have the same file name.
[[nodiscard]] Result<Evaluation> evaluate(const std::filesystem::path& truth_path,
                                          const std::filesystem::path& result_folder, const EvaluateOptions& options,
                                          const Context& context);

/// The same for a record at hand; `result_folder` is where its segments are looked for.
[[nodiscard]] Result<Evaluation> evaluate(const Truth& truth, const io::RunRecord& record,
                                          const std::filesystem::path& result_folder, const EvaluateOptions& options,
                                          const Context& context);

[[nodiscard]] std::string to_json(const Evaluation& evaluation);   ///< docs/evaluate.md lists the fields
[[nodiscard]] std::string to_table(const Evaluation& evaluation);  ///< for people, one line a scan, then the sums

}  // namespace asbuilt::evaluate
