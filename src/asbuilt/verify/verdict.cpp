// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace asbuilt::verify {
namespace {

constexpr std::size_t kMostCandidates = 10;
constexpr double kSamePose = 0.04;   // displacement / diameter up to which two candidates are one
constexpr double kSamePlace = 0.35;  // distance of the centres / diameter from which they are two placements

double distance_of_centres_mm(const Candidate& a, const Candidate& b, const model::PreparedModel& model) {
  const Eigen::Vector3d centre = model.box.center();
  return (a.model_from_scan.inverse() * centre - b.model_from_scan.inverse() * centre).norm();
}

// Score, normals and fit are nearly independent witnesses, so a pose that is mediocre in all three is less credible
// than one that is weak in a single one. 1 for a perfect pose; residuals strewn evenly over the band bring it to 0.
double proof(const Candidate& c) {
  const double evenly_strewn = 1.0 / std::sqrt(3.0);
  return c.score * c.normal_agreement * std::max(0.0, 1.0 - c.residual_ratio / evenly_strewn);
}

struct Finding {
  Reason reason = Reason::none;
  std::string explanation;
};

// What stands against a candidate on its own; none if it would be accepted without rivals.
Finding objection(const Candidate& c, const VerifyOptions& options) {
  if (c.explained_samples < options.min_explained_samples) {
    return {Reason::too_few_points,
            fmt::format("the scan confirms {} samples of the model, {} are needed to prove a pose", c.explained_samples,
                        options.min_explained_samples)};
  }
  if (c.score < options.acceptance_score) {
    return {Reason::low_score, fmt::format("{:.0f} % of what should be visible was found, {:.0f} % are needed",
                                           100.0 * c.score, 100.0 * options.acceptance_score)};
  }
  if (!options.paper_mode && c.free_space_violations > options.max_free_space_share) {
    return {Reason::free_space_violated,
            fmt::format("the sensor saw through {:.0f} % of the claimed surface, at most {:.0f} % are allowed",
                        100.0 * c.free_space_violations, 100.0 * options.max_free_space_share)};
  }
  if (!options.paper_mode && c.residual_ratio > options.max_residual_ratio) {
    return {Reason::poor_fit,
            fmt::format("the points on the model scatter by {:.2f} mm, {:.2f} of the distance that counts as on it; at "
                        "most {:.2f} is allowed",
                        c.rms_mm, c.residual_ratio, options.max_residual_ratio)};
  }
  if (!options.paper_mode && c.contradiction_share > options.max_contradiction_share) {
    return {Reason::contradicted,
            fmt::format("the scan denies {:.0f} % of the claimed surface, at most {:.0f} % are allowed",
                        100.0 * c.contradiction_share, 100.0 * options.max_contradiction_share)};
  }
  if (!options.paper_mode && c.weakest_direction < options.min_weakest_direction) {
    return {Reason::under_constrained,
            fmt::format(
                "the surface that was found would let the part slide or turn (weakest direction {:.4f}, {:.4f} needed)",
                c.weakest_direction, options.min_weakest_direction)};
  }
  if (c.normal_agreement < options.min_normal_agreement) {
    return {Reason::normals_disagree, fmt::format("{:.0f} % of the normals agree with the model, {:.0f} % are needed",
                                                  100.0 * c.normal_agreement, 100.0 * options.min_normal_agreement)};
  }
  const double needed = options.min_proof + options.hidden_surcharge * c.hidden_share;
  if (!options.paper_mode && proof(c) < needed) {
    return {Reason::weak_evidence,
            fmt::format("score {:.2f}, normals {:.2f} and scatter {:.2f} together prove {:.2f}, {:.2f} are needed",
                        c.score, c.normal_agreement, c.residual_ratio, proof(c), needed)};
  }
  return {};
}

// A different pose that would itself be accepted and explains about as much.
Finding rivalry(const std::vector<Candidate>& candidates, const model::PreparedModel& model,
                const VerifyOptions& options) {
  const Candidate& best = candidates.front();
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const Candidate& rival = candidates[i];
    if (objection(rival, options).reason != Reason::none || !is_comparable(rival, best)) continue;
    if (!is_in_one_place(best, rival, model)) {
      return {Reason::second_instance, second_instance_sentence(best, rival, model)};
    }
    if (best.support - rival.support < options.min_margin * best.support) {
      return {Reason::ambiguous_pose,
              fmt::format(
                  "a pose that differs by up to {:.1f} mm explains the scan about as well: score {:.3f} beside {:.3f}",
                  displacement_mm(best.model_from_scan, rival.model_from_scan, model), rival.score, best.score)};
    }
  }
  return {};
}

}  // namespace

const char* code_of(Reason reason) {
  switch (reason) {
    case Reason::none:
      return "";
    case Reason::no_hypothesis:
      return "no_hypothesis";
    case Reason::low_score:
      return "low_score";
    case Reason::poor_fit:
      return "poor_fit";
    case Reason::normals_disagree:
      return "normals_disagree";
    case Reason::free_space_violated:
      return "free_space_violated";
    case Reason::under_constrained:
      return "under_constrained";
    case Reason::contradicted:
      return "contradicted";
    case Reason::weak_evidence:
      return "weak_evidence";
    case Reason::too_few_points:
      return "too_few_points";
    case Reason::ambiguous_pose:
      return "ambiguous_pose";
    case Reason::second_instance:
      return "second_instance";
    case Reason::scan_too_small:
      return "scan_too_small";
    case Reason::wrong_unit:
      return "wrong_unit";
  }
  return "";
}

double displacement_mm(const Pose& a_from_scan, const Pose& b_from_scan, const model::PreparedModel& model) {
  const Pose b_from_a = b_from_scan * a_from_scan.inverse();
  double largest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d point = model.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    largest = std::max(largest, (b_from_a * point - point).norm());
  }
  return largest;
}

std::vector<Candidate> best_different(std::vector<Candidate> candidates, std::size_t most, double least_apart_mm,
                                      const model::PreparedModel& model) {
  std::ranges::stable_sort(candidates, std::ranges::greater{}, &Candidate::support);
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates) {
    if (kept.size() == most) break;
    const bool is_new = std::ranges::none_of(kept, [&](const Candidate& other) {
      return displacement_mm(other.model_from_scan, candidate.model_from_scan, model) <= least_apart_mm;
    });
    if (is_new) kept.push_back(candidate);
  }
  return kept;
}

bool is_comparable(const Candidate& rival, const Candidate& best) {
  constexpr double kProofShare = 0.75, kSupportShare = 0.25;
  return proof(rival) >= kProofShare * proof(best) && rival.support >= kSupportShare * best.support;
}

bool is_in_one_place(const Candidate& a, const Candidate& b, const model::PreparedModel& model) {
  return distance_of_centres_mm(a, b, model) <= kSamePlace * model.diameter;
}

bool is_second_instance(const Candidate& best, const Candidate& rival, const model::PreparedModel& model,
                        const VerifyOptions& options) {
  return !is_in_one_place(best, rival, model) && is_comparable(rival, best) &&
         objection(rival, options).reason == Reason::none;
}

std::string second_instance_sentence(const Candidate& best, const Candidate& rival, const model::PreparedModel& model) {
  return fmt::format("the part stands in a second place, {:.0f} mm away, with score {:.2f} beside {:.2f}",
                     distance_of_centres_mm(best, rival, model), rival.score, best.score);
}

Detection decide(std::vector<Candidate> candidates, const model::PreparedModel& model, const VerifyOptions& options) {
  Detection detection;
  if (candidates.empty()) {
    detection.explanation = "no pose of the part was proposed";
    return detection;
  }
  detection.candidates = best_different(std::move(candidates), kMostCandidates, kSamePose * model.diameter, model);
  for (Candidate& candidate : detection.candidates) candidate.objection = objection(candidate, options).reason;
  detection.best = detection.candidates.front();
  detection.margin = detection.best.support - (detection.candidates.size() > 1 ? detection.candidates[1].support : 0.0);

  Finding finding = objection(detection.best, options);
  if (finding.reason != Reason::none) {
    detection.reason = finding.reason;
    detection.explanation = std::move(finding.explanation);
    return detection;
  }
  if (!options.paper_mode) finding = rivalry(detection.candidates, model, options);
  detection.reason = finding.reason;
  detection.status = finding.reason == Reason::none ? Status::accepted : Status::ambiguous;
  detection.explanation =
      finding.reason == Reason::none
          ? fmt::format("{:.0f} % of what should be visible was found, {:.0f} % of the normals agree",
                        100.0 * detection.best.score, 100.0 * detection.best.normal_agreement)
          : std::move(finding.explanation);
  return detection;
}

}  // namespace asbuilt::verify
