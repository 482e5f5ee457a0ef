// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "../stopwatch.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "cases.h"
#include "parts.h"

namespace asbuilt::bench {

/// Wall and processor time of one step, seconds.
struct StepTime {
  double wall = 0.0, cpu = 0.0;
};

/// Adds the time until it is destroyed.
class Timed {
 public:
  explicit Timed(StepTime& time);
  ~Timed();
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

 private:
  StepTime& time_;
  Stopwatch watch_;
};

/// A pose against the truth. Without the part there is no displacement, and no pose is right.
struct Judged {
  bool has_pose = false;
  bool right = false;
  std::optional<double> displacement;  ///< largest of a vertex / diameter, modulo the part's symmetry
  double score = 0.0;                  ///< what a threshold on this kind of result would be set on
};

/// What came of one scan: one line of cases.jsonl.
struct CaseRecord {
  std::uint64_t seed = 0;
  std::string mode;   ///< who judged it, with what options
  std::string group;  ///< the list of parts that the seed chose from: distinct, symmetric or all
  std::string part, content, stratum, sensor;
  double hidden = 1.0, occlusion = 1.0, clutter = 1.0, noise_ratio = 0.0, deviation_ratio = 0.0, diameter_mm = 0.0;
  std::size_t points = 0, part_points = 0;

  std::string status, reason_code, reason;
  Judged best;        ///< the best candidate, whatever its status; score: ours
  Judged unverified;  ///< the cluster with most votes, registered; score: its votes
  double votes = 0.0, support = 0.0, visible_share = 0.0, normal_agreement = 0.0, contradiction_share = 0.0,
         hidden_share = 0.0, missing_share = 0.0, facing_share = 0.0, residual_ratio = 0.0, weakest_direction = 0.0,
         slip_lead = 0.0, size_hold = 0.0, size_lead = 0.0, lost_end_share = 0.0, pierced_share = 0.0,
         overrun_share = 0.0;
  int explained_samples = 0;
  int loose_directions = 0;
  std::uint64_t votes_cast = 0;  ///< by all reference points
  int looks = 0;                 ///< 1: few reference points were enough
  std::size_t hypotheses = 0;
  std::optional<std::size_t> right_rank;  ///< of the first hypothesis near the truth, before verification, from 0
  /// For a part that was not found: what verification says of the true pose alone, "accepted" or its reason's code. So
  /// one knows whether detection or verification missed it. Empty for all others.
  std::string verdict_on_truth;
  StepTime prepare_model;  ///< once for all scans of the part
  StepTime prepare_scan, detect, verify;

  [[nodiscard]] bool present() const { return content == "part"; }
  [[nodiscard]] bool accepted() const { return status == "accepted"; }
  [[nodiscard]] bool found() const { return accepted() && best.right; }
  [[nodiscard]] bool wrong() const { return accepted() && !best.right; }
  [[nodiscard]] double seconds() const { return prepare_scan.wall + detect.wall + verify.wall; }
  [[nodiscard]] double cpu_seconds() const { return prepare_scan.cpu + detect.cpu + verify.cpu; }
};

/// A pose against the truth: right if no vertex is displaced by more than 2 % of the diameter.
[[nodiscard]] Judged judged(const Pose& model_from_scan, const std::optional<Pose>& true_model_from_scan,
                            const SuitePart& part);

/// The first pose near enough to the truth (a tenth of the diameter, 12 degrees) for a registration to have a fair
/// chance.
[[nodiscard]] std::optional<std::size_t> first_near(std::span<const Pose> model_from_scan,
                                                    const std::optional<Pose>& true_model_from_scan,
                                                    const SuitePart& part);

/// What the case is, before anything looks at its scan.
[[nodiscard]] CaseRecord record_of(const Case& the_case, const SuitePart& part, const CaseScan& scan);

/// One line of JSON, without its end. Errors of the second: unreadable_input.
[[nodiscard]] std::string to_line(const CaseRecord& record);
[[nodiscard]] Result<CaseRecord> record_of(const std::string& line);

/// All records of a file, by (mode, group, seed); empty if there is none. The last line may be cut short, when a run
/// was killed: it does not count.
[[nodiscard]] Result<std::vector<CaseRecord>> read_records(const std::filesystem::path& path);

/// Appends a line to a file that other processes append to as well.
[[nodiscard]] Result<void> append(const std::filesystem::path& path, const CaseRecord& record);

}  // namespace asbuilt::bench
