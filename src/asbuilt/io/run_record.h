// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"

namespace asbuilt::io {

/// What became of a scan; the words of result.json.
enum class ScanStatus { accepted, ambiguous, rejected, dropped, disconnected, failed };
[[nodiscard]] std::string_view name_of(ScanStatus status);

/// Whether a run is finished; the words of result.json.
enum class RunState { complete, partial, failed };
[[nodiscard]] std::string_view name_of(RunState state);

/// One option as it was used, under its name on the command line with underscores.
using OptionValue = std::variant<bool, std::int64_t, double, std::string, std::vector<std::string>>;
using Options = std::vector<std::pair<std::string, OptionValue>>;

struct ModelRecord {
  std::string path;  ///< as the user gave it
  std::string sha256;
  std::uint64_t triangles = 0;
  double diameter = 0.0, sampling_distance = 0.0;  ///< mm
  std::string symmetry = "none";
};

/// One of the poses that verification looked at last.
struct CandidateRecord {
  Pose model_from_scan = Pose::Identity();
  double votes = 0.0, score = 0.0, visible_share = 0.0, free_space_violations = 0.0, normal_agreement = 0.0, rms = 0.0;
  double hidden_share = 0.0, support = 0.0;
  int explained_samples = 0;
  /// Of the surface that ought to be visible (facing_share of all) and is not hidden: confirmed, denied, without
  /// return. NaN in results of versions that did not tell.
  double facing_share = kNotTold, found_share = kNotTold, contradiction_share = kNotTold, missing_share = kNotTold;
  double residual_ratio = kNotTold;     ///< rms / distance that counts as on the model
  double weakest_direction = kNotTold;  ///< how firmly the surface that was found holds the pose
  double slip_lead = kNotTold;          ///< measurements by which the pose leads over the small slip that comes closest
  double size_hold = kNotTold;          ///< how firmly that surface holds the part's size
  double size_lead = kNotTold;          ///< measurements by which the pose leads over the part in another size
  double pierced_share = kNotTold;      ///< of the part, what lies behind a flat surface that it would reach through
  double lost_end_share = kNotTold;     ///< of what was looked at, at an end of unknown place, where nothing came back
  double overrun_share = kNotTold;      ///< of the part's edges, those past which the scan's surface goes on
  std::string objection;                ///< reason code of what stands against it on its own; empty: nothing

  static constexpr double kNotTold = std::numeric_limits<double>::quiet_NaN();
};

/// A slide, or a turn about an axis, in the model frame.
struct MotionRecord {
  bool is_turn = false;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d through = Eigen::Vector3d::Zero();  ///< a point of the axis; of a slide: the middle of what slides
  double sigma = 0.0;                                 ///< standard deviation, mm; of a scan only
  bool unheld = false;                                ///< nothing holds it
};

struct ScanRecord {
  std::string path;  ///< as the user gave it
  std::string name;
  int index_in_file = 0, scans_in_file = 1;
  int instance = 1, instances_in_scan = 1;  ///< which placement of the part in the scan, of how many that were found
  std::string sha256;                       ///< of the file; empty when it could not be read
  std::uint64_t points = 0;                 ///< usable ones, after sanitising
  std::optional<Eigen::Vector3d> viewpoint;
  std::string viewpoint_kind = "none";  ///< "point" (a position), "direction" (in which parallel rays fly) or "none"
  std::string viewpoint_source = "none";  ///< who says so: "stated", "file", "origin", "points" or "none"
  bool normals_oriented = false;
  double noise_sigma = 0.0, spacing = 0.0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< taken off inside, already put back in every pose here
  ScanStatus status = ScanStatus::failed;
  std::string reason_code, reason;
  std::optional<Pose> model_from_scan_detected, model_from_scan;
  std::optional<Matrix6d> covariance;
  std::optional<int> component;
  std::vector<double> hold_sigma;           ///< mm, of six principal motions against the fixed scan, descending
  std::vector<MotionRecord> loose_motions;  ///< those along which the scans it overlaps hold it badly or not at all
  double votes = 0.0, score = 0.0, visible_share = 0.0, free_space_violations = 0.0, normal_agreement = 0.0;
  double margin = 0.0;
  std::vector<CandidateRecord> candidates;
  std::uint64_t segment_points = 0;
  std::vector<std::string> warnings;

  /// Whether segments/ holds this scan's part.
  [[nodiscard]] bool has_segment() const { return segment_points > 0; }
};

struct OverlapRecord {
  int a = 0, b = 0;  ///< indices into RunRecord::scans
  double overlap = 0.0;
  bool linked = false;
};

struct GraphRecord {
  std::vector<OverlapRecord> overlaps;
  std::vector<std::vector<int>> components;  ///< indices into RunRecord::scans, largest component first
};

struct EdgeRecord {
  int from = 0, to = 0;  ///< indices into RunRecord::scans: points of `from`, planes of `to`
  std::uint64_t pairs = 0;
  double rms = 0.0;
};

/// How well each direction is held by what two scans share.
struct LinkRecord {
  int a = 0, b = 0;                        ///< indices into RunRecord::scans
  std::vector<double> held;                ///< information of six principal motions, ascending; 1: every match holds it
  std::vector<MotionRecord> free_motions;  ///< those that nothing both see holds
};

struct RefinementRecord {
  int component = 0, fixed_scan = 0, iterations = 0;
  double rms_before = 0.0, rms_after = 0.0;
  bool converged = false;
  bool on_model = false;  ///< scans hold one another loosely: the CAD has helped to place them
  std::string gauge_method = "best_fit";  ///< "best_fit" or "fixed"
  Pose model_from_refined = Pose::Identity();
  std::vector<EdgeRecord> edges;
  std::vector<LinkRecord> links;
};

struct DeviationRecord {
  double mean = 0.0, sigma = 0.0, rms = 0.0, p95 = 0.0;
  std::optional<double> in_tolerance;
  double coverage = 0.0;
  std::string verdict = {};  ///< "pass", "fail", "not enough data" or "not scanned"; empty without a tolerance
};

/// result.json, schema 1 (docs/result-json.md). Lengths in mm, poses in the coordinates of the files.
struct RunRecord {
  static constexpr int kSchema = 1;
  std::string version;  ///< of asbuilt
  RunState state = RunState::partial;
  Options options;
  ModelRecord model;
  std::vector<ScanRecord> scans;
  std::optional<GraphRecord> graph;  ///< these three are absent from what `detect` writes
  std::optional<std::vector<RefinementRecord>> refinement;
  std::optional<DeviationRecord> deviation;
};

/// The text of result.json. Numbers come back exactly as they were; what is not finite becomes null.
[[nodiscard]] std::string to_json(const RunRecord& record);

/// Reads what to_json wrote. `name` stands in errors. Errors: unreadable_input (no JSON, another schema, a wrong type).
[[nodiscard]] Result<RunRecord> run_record_from_json(std::string_view text, std::string_view name);
[[nodiscard]] Result<RunRecord> read_run_record(const std::filesystem::path& result_json);

/// segments/NNN_NAME.ply, where NNN is the scan's index in the record; characters that file systems mistrust become _.
[[nodiscard]] std::filesystem::path segment_file(std::size_t scan_index, std::string_view scan_name);

/// Seconds and memory of one stage.
struct StageTime {
  std::string stage;
  std::string scan;  ///< empty for stages over all scans
  double seconds = 0.0;
  std::uint64_t peak_memory_bytes = 0;  ///< of the whole process so far
};

/// timing.json: everything that may differ between two runs of the same command.
struct TimingRecord {
  std::string command;            ///< the verb, "reconstruct", "detect" or "register"
  std::string started, finished;  ///< UTC, ISO 8601; finished is empty while the run is going on
  int threads = 0;
  double seconds = 0.0;
  std::vector<StageTime> stages;
};
[[nodiscard]] std::string to_json(const TimingRecord& timing);
[[nodiscard]] Result<TimingRecord> read_timing_record(const std::filesystem::path& timing_json);

}  // namespace asbuilt::io
