// SPDX-License-Identifier: Apache-2.0
#include "explain_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "asbuilt/verify/verdict.h"

namespace asbuilt::cli {
namespace {

/// Of an option as the run used it; nothing if the result does not tell.
std::optional<double> option_of(const io::RunRecord& record, std::string_view name) {
  const auto found =
      std::ranges::find(record.options, name, [](const auto& option) { return std::string_view(option.first); });
  if (found == record.options.end()) return std::nullopt;
  if (const auto* whole = std::get_if<std::int64_t>(&found->second)) return static_cast<double>(*whole);
  const auto* real = std::get_if<double>(&found->second);
  return real != nullptr ? std::optional(*real) : std::nullopt;
}

bool in_paper_mode(const io::RunRecord& record) {
  return std::ranges::any_of(record.options, [](const auto& option) {
    return option.first == "paper_mode" && option.second == io::OptionValue(true);
  });
}

/// " (at most 8 % allowed)", or nothing where no limit is known.
std::string limit(const io::RunRecord& record, std::string_view option, std::string_view words, double factor,
                  std::string_view unit) {
  const auto value = option_of(record, option);
  return value ? fmt::format(" ({} {:.3g}{})", words, factor * *value, unit) : std::string();
}

std::string percent_needed(const io::RunRecord& record, std::string_view option) {
  return limit(record, option, "needed:", 100.0, " %");
}
std::string percent_allowed(const io::RunRecord& record, std::string_view option) {
  return limit(record, option, "allowed:", 100.0, " %");
}

std::string words_of(const std::string& objection) {
  if (objection.empty()) return "nothing stands against it on its own";
  if (objection == "too_few_points") return "too little of the part was found to prove anything";
  if (objection == "low_score") return "too little of what should be visible was found";
  if (objection == "free_space_violated") return "the sensor saw through too much of it";
  if (objection == "poor_fit") return "the points scatter about its surface instead of lying on it";
  if (objection == "contradicted") return "the scan denies too much of it";
  if (objection == "under_constrained") return "what was found would let it slide or turn";
  if (objection == "normals_disagree") return "too few normals agree";
  if (objection == "weak_evidence") return "score, normals and scatter together prove too little";
  return objection;
}

std::string input_sentence(const io::ScanRecord& scan) {
  if (scan.points == 0) return {};
  std::string text =
      fmt::format("  The scan holds {} usable points, about {:.3g} mm apart, with a noise of {:.3g} mm (1 sigma)",
                  scan.points, scan.spacing, scan.noise_sigma);
  if (scan.viewpoint) {
    text += fmt::format("; {} {:.4g}, {:.4g}, {:.4g}.\n",
                        scan.viewpoint_kind == "point" ? "the sensor stood at" : "its parallel rays fly along",
                        scan.viewpoint->x(), scan.viewpoint->y(), scan.viewpoint->z());
  } else {
    text += "; where the sensor stood is not known, so what it saw through cannot speak against a pose.\n";
  }
  for (const std::string& warning : scan.warnings) text += fmt::format("  Note: {}\n", warning);
  if (scan.instances_in_scan > 1) {
    text += fmt::format("  This is placement {} of the {} that were found in the scan.\n", scan.instance,
                        scan.instances_in_scan);
  }
  return text;
}

// What ought to be visible, and what became of it.
std::string surface_sentences(const io::RunRecord& record, const io::CandidateRecord& best) {
  if (std::isnan(best.facing_share)) return {};
  const double elsewhere = std::max(0.0, best.contradiction_share - best.free_space_violations);
  return fmt::format(
             "  Should be visible: {:.0f} % of the part's surface is turned to the sensor and not behind the part "
             "itself. Other things stand in front of {:.0f} % of that, which counts neither way.\n",
             100.0 * best.facing_share, 100.0 * best.hidden_share) +
         fmt::format(
             "  For the pose: of the rest, {:.0f} % was found where the model has it ({} samples of the model).\n",
             100.0 * best.found_share, best.explained_samples) +
         fmt::format(
             "  Against it: {:.0f} % is denied{}, of which {:.0f} % was seen through, as the sensor measured something "
             "behind it{}, and {:.0f} % has its surface in another place. From {:.0f} % nothing came back, which "
             "counts a quarter.\n",
             100.0 * best.contradiction_share, percent_allowed(record, "max_contradiction_share"),
             100.0 * best.free_space_violations, percent_allowed(record, "max_free_space_share"), 100.0 * elsewhere,
             100.0 * best.missing_share);
}

std::string quality_sentences(const io::RunRecord& record, const io::CandidateRecord& best) {
  std::string text =
      fmt::format("  Score: {:.2f}{}.\n", best.score, limit(record, "acceptance_score", "needed:", 1.0, ""));
  text += fmt::format("  Normals: {:.0f} % of those of the scan on the model agree with it{}.\n",
                      100.0 * best.normal_agreement, percent_needed(record, "min_normal_agreement"));
  text += fmt::format("  Scatter: the points on the model lie {:.3g} mm (RMS) off it", best.rms);
  if (std::isnan(best.residual_ratio)) return text + ".\n";
  text += fmt::format(", {:.2f} of the distance that counts as on it{}; 0.58 would be no fit at all.\n",
                      best.residual_ratio, limit(record, "max_residual_ratio", "allowed:", 1.0, ""));
  const auto least = option_of(record, "min_weakest_direction");
  verify::VerifyOptions limits;
  limits.min_weakest_direction = least.value_or(0.0);
  limits.missing_hold_surcharge = option_of(record, "missing_hold_surcharge").value_or(0.0);
  const double needed = verify::hold_needed(std::isnan(best.missing_share) ? 0.0 : best.missing_share, limits);
  text += fmt::format(
      "  Hold: {:.4f}{} in the direction in which the surface that was found lets the part slide or turn most easily; "
      "0 would be free",
      best.weakest_direction, least ? fmt::format(" (needed: {:.4g})", needed) : "");
  // Edges are asked only where the surface alone is loose.
  if (!std::isnan(best.slip_lead) && least && best.weakest_direction < needed) {
    text += fmt::format("; its edges: {:.0f} measurements more than for the slip that comes closest", best.slip_lead);
  }
  text += ".\n";
  if (!std::isnan(best.size_hold) && least && best.size_hold < needed) {
    text += fmt::format(
        "  Size: the surface that was found would be the same on a larger or smaller part; its edges: {:.0f} "
        "measurements more than for one of another size.\n",
        best.size_lead);
  }
  if (best.lost_end_share > 0.0) {  // NaN: from an older run
    text += fmt::format(
        "  Ends: {:.1f} % of what was looked at gave nothing back at an end of the part whose place nothing else "
        "tells{}.\n",
        100.0 * best.lost_end_share, percent_allowed(record, "max_lost_end_share"));
  }
  if (best.pierced_share > 0.0) {  // NaN: from an older run
    text += fmt::format("  Flat surfaces: {:.0f} % of the part would lie behind one that it would reach through{}.\n",
                        100.0 * best.pierced_share, percent_allowed(record, "max_pierced_share"));
  }
  if (std::isnan(best.overrun_share)) return text;
  text += fmt::format("  Edges: past {:.0f} % of the part's edges the surface goes on{}.\n", 100.0 * best.overrun_share,
                      percent_allowed(record, "max_overrun_share"));
  const auto most_overrun = option_of(record, "max_overrun_share");
  const auto most_denied = option_of(record, "max_contradiction_share");
  if (!most_overrun || !most_denied || !(*most_overrun > 0.0) || !(*most_denied > 0.0)) return text;
  text += fmt::format("  Together: contradictions and edges, each as a share of what is allowed, come to {:.2f}{}.\n",
                      best.contradiction_share / *most_denied + best.overrun_share / *most_overrun,
                      limit(record, "max_joint_denial", "allowed:", 1.0, ""));
  return text;
}

// The candidate that the entry is about: the best, or the one that the user vouched for.
std::size_t judged_candidate(const io::ScanRecord& scan) {
  if (!scan.model_from_scan_detected) return 0;
  std::size_t nearest = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scan.candidates.size(); ++i) {
    const double difference =
        (scan.candidates[i].model_from_scan.matrix() - scan.model_from_scan_detected->matrix()).norm();
    if (difference < least) nearest = i, least = difference;
  }
  return nearest;
}

std::string evidence_sentences(const io::RunRecord& record, const io::ScanRecord& scan) {
  if (scan.candidates.empty()) return {};
  const io::CandidateRecord& best = scan.candidates[judged_candidate(scan)];
  if (in_paper_mode(record)) {
    return fmt::format(
        "  Score: {:.2f}{}, the share of the model's whole surface that was found (Eq. 11).\n"
        "  Normals: {:.0f} % agree{}.\n",
        best.score, limit(record, "acceptance_score", "needed:", 1.0, ""), 100.0 * best.normal_agreement,
        percent_needed(record, "min_normal_agreement"));
  }
  return surface_sentences(record, best) + quality_sentences(record, best);
}

// The next different pose, how it differs, and what stands against it.
std::string runner_up_sentence(const io::RunRecord& record, const io::ScanRecord& scan) {
  if (scan.candidates.empty()) return {};
  if (scan.candidates.size() == 1) return "  Runner-up: there was no other pose to compare it with.\n";
  const std::size_t judged = judged_candidate(scan), other = judged == 0 ? 1 : 0;
  const io::CandidateRecord &best = scan.candidates[judged], &next = scan.candidates[other];
  const Pose next_from_best = next.model_from_scan * best.model_from_scan.inverse();
  const double angle_deg = rotation_angle(next_from_best.linear()) * 180.0 / std::numbers::pi;
  const double moved_mm =
      (next.model_from_scan.inverse().translation() - best.model_from_scan.inverse().translation()).norm();
  std::string text = fmt::format(
      "  Runner-up: candidate {}, turned by {:.1f} degrees against it, the model's origin {:.4g} mm away. Evidence for "
      "less evidence against gives it a support of {:.3f}, beside {:.3f}",
      other, angle_deg, moved_mm, next.support, best.support);
  if (next.objection.empty() && best.support > 0.0) {
    text += fmt::format(", a margin of {:.0f} %", 100.0 * (best.support - next.support) / best.support);
    text += limit(record, "min_margin", "needed in one place:", 100.0, " %");
  }
  return text + fmt::format("; {}.\n", words_of(next.objection));
}

std::string candidate_lines(const io::ScanRecord& scan) {
  std::string text;
  for (std::size_t i = 0; i < scan.candidates.size(); ++i) {
    const io::CandidateRecord& candidate = scan.candidates[i];
    const Eigen::Vector3d at = candidate.model_from_scan.inverse().translation();
    text += fmt::format(
        "  candidate {}: support {:.3f}, score {:.3f}, normals {:.0f} %, seen through {:.0f} %, votes {:.4g}, model "
        "origin at ({:.4g}, {:.4g}, {:.4g}) mm in the scan; {}\n",
        i, candidate.support, candidate.score, 100.0 * candidate.normal_agreement,
        100.0 * candidate.free_space_violations, candidate.votes, at.x(), at.y(), at.z(),
        words_of(candidate.objection));
  }
  return text;
}

std::string registration_sentences(const io::RunRecord& record, std::size_t index) {
  const io::ScanRecord& scan = record.scans[index];
  std::string text;
  if (scan.component) text += fmt::format("  It belongs to component {} of the pose graph.\n", *scan.component);
  if (scan.covariance) {
    const double translation_sigma = std::sqrt(scan.covariance->bottomRightCorner<3, 3>().trace());
    if (translation_sigma > 0.0) {
      text +=
          fmt::format("  The joint refinement holds its position to about {:.3g} mm (1 sigma, all axes together).\n",
                      translation_sigma);
    }
  }
  if (!record.graph) return text;
  for (const io::OverlapRecord& pair : record.graph->overlaps) {
    if (!pair.linked) continue;
    const int self = static_cast<int>(index);
    const int other = pair.a == self ? pair.b : pair.b == self ? pair.a : -1;
    if (other < 0) continue;
    text += fmt::format("  It is linked to {} (overlap {:.0f} %).\n",
                        record.scans[static_cast<std::size_t>(other)].name, 100.0 * pair.overlap);
  }
  return text;
}

std::string advice_for(const io::ScanRecord& scan) {
  std::string text;
  if (scan.status == io::ScanStatus::ambiguous) {
    text = fmt::format("  To choose one yourself, run detect or reconstruct again with --accept {}:CANDIDATE.\n",
                       scan.name);
    if (scan.reason_code == "second_instance" && scan.instances_in_scan == 1) {
      text +=
          "  If the part really stands there more than once, --instances all makes a detection of each placement.\n";
    }
  } else if (scan.status == io::ScanStatus::rejected && !scan.candidates.empty()) {
    text = fmt::format(
        "  If a candidate below is right after all: --accept {}:CANDIDATE. A pose you know: --poses FILE.\n",
        scan.name);
  } else if (scan.status == io::ScanStatus::disconnected) {
    text = "  A scan that overlaps both sides would join it to the others.\n";
  }
  return text;
}

}  // namespace

std::string explanation_of(const io::RunRecord& record, std::size_t index) {
  const io::ScanRecord& scan = record.scans[index];
  std::string text = fmt::format("{} ({}) is {}", scan.name, scan.path, io::name_of(scan.status));
  if (!scan.reason_code.empty()) text += fmt::format(" [{}]", scan.reason_code);
  text += scan.reason.empty() ? ".\n" : fmt::format(": {}.\n", scan.reason);
  return text + input_sentence(scan) + evidence_sentences(record, scan) + runner_up_sentence(record, scan) +
         registration_sentences(record, index) + advice_for(scan) + candidate_lines(scan);
}

}  // namespace asbuilt::cli
