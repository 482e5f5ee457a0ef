// SPDX-License-Identifier: Apache-2.0
#include "product.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <span>
#include <utility>

#include "asbuilt/detect/detect.h"
#include "asbuilt/evaluate/evaluate.h"
#include "asbuilt/evaluate/pose_error.h"
#include "asbuilt/pipeline/scan_hints.h"
#include "asbuilt/pipeline/unit_check.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::bench {
namespace {

// How near a hypothesis must be for the registration to have a fair chance.
constexpr double kNearAngleDeg = 12.0, kNearShare = 0.1;

double processor_seconds() {
  std::timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Adds the time until it is destroyed.
class Timed {
 public:
  explicit Timed(StepTime& time) : time_(time) {}
  ~Timed() {
    time_.cpu += processor_seconds() - cpu_begin_;
    time_.wall += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  }
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

 private:
  StepTime& time_;
  double cpu_begin_ = processor_seconds();
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

std::optional<std::size_t> first_near(std::span<const detect::Hypothesis> hypotheses, const Pose& truth,
                                      const SuitePart& part) {
  const double reach = kNearShare * diameter(part.mesh);
  const auto near = std::ranges::find_if(hypotheses, [&](const detect::Hypothesis& hypothesis) {
    const auto error = evaluate::pose_error(hypothesis.model_from_scan, truth, part.mesh, part.symmetries);
    return error.angle_deg <= kNearAngleDeg && error.translation_mm <= reach;
  });
  if (near == hypotheses.end()) return std::nullopt;
  return static_cast<std::size_t>(near - hypotheses.begin());
}

void note(CaseRecord& record, const verify::Detection& detection) {
  const bool accepted = detection.status == verify::Status::accepted;
  record.status = accepted ? "accepted" : detection.status == verify::Status::ambiguous ? "ambiguous" : "rejected";
  record.reason_code = detection.reason == verify::Reason::none ? "" : verify::code_of(detection.reason);
  record.reason = detection.explanation;
  if (detection.candidates.empty()) return;
  const verify::Candidate& best = detection.best;
  record.votes = best.votes;
  record.support = best.support;
  record.visible_share = best.visible_share;
  record.normal_agreement = best.normal_agreement;
  record.contradiction_share = best.contradiction_share;
  record.hidden_share = best.hidden_share;
  record.residual_ratio = best.residual_ratio;
  record.weakest_direction = best.weakest_direction;
  record.explained_samples = best.explained_samples;
}

void note_failure(CaseRecord& record, const char* code, std::string reason) {
  record.status = "failed";
  record.reason_code = code;
  record.reason = std::move(reason);
}

}  // namespace

Result<PreparedPart> prepared(const SuitePart& part, const pipeline::Options& options, const Context& context) {
  ASBUILT_TRY(model, model::prepare(part.mesh, options.model, context));
  ASBUILT_TRY(codebook, detect::build_codebook(model, options.detect, context));
  return PreparedPart{std::move(model), std::move(codebook)};
}

Judged judged(const Pose& model_from_scan, const std::optional<Pose>& true_model_from_scan, const SuitePart& part) {
  Judged result;
  result.has_pose = true;
  if (!true_model_from_scan) return result;
  const auto error = evaluate::pose_error(model_from_scan, *true_model_from_scan, part.mesh, part.symmetries);
  result.displacement = error.max_vertex_mm / diameter(part.mesh);
  result.right = *result.displacement <= evaluate::EvaluateOptions{}.right_ratio;
  return result;
}

CaseRecord record_of(const Case& the_case, const SuitePart& part, const CaseScan& scan) {
  CaseRecord record;
  record.seed = the_case.seed;
  record.group = name_of(part.group);
  record.part = part.name;
  record.content = name_of(the_case.content);
  record.sensor = the_case.options.sensor;
  record.hidden = scan.hidden;
  record.occlusion = scan.occlusion;
  record.clutter = scan.clutter;
  record.noise_ratio = the_case.options.noise_ratio;
  record.deviation_ratio = scan.deviation_ratio;
  record.diameter_mm = diameter(part.mesh);
  record.points = scan.points_in_scan.size();
  if (!record.present()) return record;
  const std::size_t stratum = stratum_of(scan.hidden);
  record.stratum = stratum < kStrataCount ? kStrata[stratum].name : "outside";
  return record;
}

Result<void> judge(CaseRecord& record, const CaseScan& scan_of_case, const SuitePart& part,
                   const PreparedPart& prepared, const pipeline::Options& options, const Context& context) {
  ASBUILT_TRY(viewpoints, pipeline::Viewpoints::from_text(options.viewpoint, options.scan_unit));
  Result<scan::Scan> scan;
  {
    const Timed timed(record.prepare_scan);
    scan = scan::prepare_scan(scan_of_case.points_in_scan, std::nullopt, viewpoints.of("", ""), options.scan, context);
  }
  if (!scan) return note_failure(record, "unreadable", scan.error().message), Result<void>{};
  if (const auto contradiction = pipeline::size_contradiction(*scan, prepared.model, options)) {
    return note_failure(record, verify::code_of(verify::Reason::scan_too_small), *contradiction), Result<void>{};
  }
  std::vector<detect::Hypothesis> hypotheses;
  {
    const Timed timed(record.detect);
    ASBUILT_TRY(found, detect::find_hypotheses(*scan, *prepared.codebook, options.detect, context));
    hypotheses = std::move(found);
  }
  Result<verify::Detection> detection;
  {
    const Timed timed(record.verify);
    detection = verify::verify(*scan, prepared.model, hypotheses, options.verify, context);
  }
  if (!detection) return tl::unexpected(detection.error());
  note(record, *detection);
  if (!detection->candidates.empty()) {
    record.best = judged(detection->best.model_from_scan, scan_of_case.model_from_scan, part);
    record.best.score = detection->best.score;
  }

  record.hypotheses = hypotheses.size();
  if (hypotheses.empty()) return {};
  if (scan_of_case.model_from_scan) record.right_rank = first_near(hypotheses, *scan_of_case.model_from_scan, part);
  // What one would have without a judge: the strongest cluster, registered.
  const std::span<const detect::Hypothesis> strongest(hypotheses.data(), 1);
  ASBUILT_TRY(registered, verify::verify(*scan, prepared.model, strongest, options.verify, context, true));
  record.unverified = judged(registered.best.model_from_scan, scan_of_case.model_from_scan, part);
  record.unverified.score = strongest.front().votes;
  return {};
}

}  // namespace asbuilt::bench
