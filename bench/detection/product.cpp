// SPDX-License-Identifier: Apache-2.0
#include "product.h"

#include <span>
#include <utility>

#include "asbuilt/pipeline/find_part.h"
#include "asbuilt/pipeline/scan_hints.h"
#include "asbuilt/pipeline/search_points.h"
#include "asbuilt/pipeline/unit_check.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::bench {
namespace {

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
  record.missing_share = best.missing_share;
  record.facing_share = best.facing_share;
  record.residual_ratio = best.residual_ratio;
  record.weakest_direction = best.weakest_direction;
  record.slip_lead = best.slip_lead;
  record.size_hold = best.size_hold;
  record.size_lead = best.size_lead;
  record.lost_end_share = best.lost_end_share;
  record.pierced_share = best.pierced_share;
  record.loose_directions = best.loose_directions;
  record.overrun_share = best.overrun_share;
  record.explained_samples = best.explained_samples;
}

void note_failure(CaseRecord& record, const char* code, std::string reason) {
  record.status = "failed";
  record.reason_code = code;
  record.reason = std::move(reason);
}

// Whether the judge would have accepted the part, had detection proposed the truth.
Result<std::string> verdict_on(const Pose& true_model_from_scan, const scan::Scan& scan,
                               const model::PreparedModel& model, const verify::VerifyOptions& options,
                               const Context& context) {
  const std::vector<detect::Hypothesis> truth{{true_model_from_scan, 1.0}};
  ASBUILT_TRY(detection, verify::verify(scan, model, truth, options, context));
  return detection.status == verify::Status::accepted ? "accepted" : std::string(verify::code_of(detection.reason));
}

}  // namespace

Result<PreparedPart> prepared(const SuitePart& part, const pipeline::Options& options, const Context& context) {
  ASBUILT_TRY(model, model::prepare(part.mesh, options.model, context));
  ASBUILT_TRY(codebook, detect::build_codebook(model, options.detect, context));
  return PreparedPart{std::move(model), std::move(codebook)};
}

Result<void> judge(CaseRecord& record, const CaseScan& scan_of_case, const SuitePart& part,
                   const PreparedPart& prepared, const pipeline::Options& options, const Context& context) {
  ASBUILT_TRY(viewpoints, pipeline::Viewpoints::from_text(options.viewpoint, options.scan_unit));
  Result<scan::Scan> scan;
  {
    const Timed timed(record.prepare_scan);
    PointCloud thin;
    const PointCloud& all = scan_of_case.points_in_scan;
    const auto staying = pipeline::search_points(all.positions, prepared.model, options.detect, context);
    if (staying) {
      for (const std::uint32_t i : *staying) thin.positions.push_back(all.positions[i]);
    }
    scan =
        pipeline::prepare_search(staying ? thin : all, all, std::nullopt, viewpoints.of("", ""), options.scan, context);
  }
  if (!scan) return note_failure(record, "unreadable", scan.error().message), Result<void>{};
  if (const auto contradiction = pipeline::size_contradiction(*scan, prepared.model, options)) {
    return note_failure(record, verify::code_of(verify::Reason::scan_too_small), *contradiction), Result<void>{};
  }
  const model::PreparedModel& model = prepared.model;
  const pipeline::TimedStage timed = [&](std::string_view stage, const std::function<void()>& work) {
    const Timed taken(stage == "detect" ? record.detect : record.verify);
    work();
  };
  ASBUILT_TRY(found, pipeline::find_part(*scan, model, *prepared.codebook, {}, options, timed, context));
  const verify::Detection& detection = found.placements.front();
  const std::vector<detect::Hypothesis>& hypotheses = found.hypotheses;
  record.votes_cast = found.votes_cast;
  record.looks = found.looks;
  note(record, detection);
  if (!detection.candidates.empty()) {
    record.best = judged(detection.best.model_from_scan, scan_of_case.model_from_scan, part);
    record.best.score = detection.best.score;
  }

  if (record.present() && !record.found() && scan_of_case.model_from_scan) {
    ASBUILT_TRY(verdict, verdict_on(*scan_of_case.model_from_scan, *scan, prepared.model, options.verify, context));
    record.verdict_on_truth = std::move(verdict);
  }
  record.hypotheses = hypotheses.size();
  if (hypotheses.empty()) return {};
  std::vector<Pose> poses;
  for (const detect::Hypothesis& hypothesis : hypotheses) poses.push_back(hypothesis.model_from_scan);
  record.right_rank = first_near(poses, scan_of_case.model_from_scan, part);
  // What one would have without a judge: the strongest cluster, registered.
  const std::span<const detect::Hypothesis> strongest(hypotheses.data(), 1);
  ASBUILT_TRY(registered, verify::verify(*scan, prepared.model, strongest, options.verify, context, true));
  record.unverified = judged(registered.best.model_from_scan, scan_of_case.model_from_scan, part);
  record.unverified.score = strongest.front().votes;
  return {};
}

}  // namespace asbuilt::bench
