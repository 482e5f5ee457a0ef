// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "asbuilt/verify/near_poses.h"

namespace asbuilt::verify {
namespace {

constexpr std::size_t kMostCandidates = 10;
constexpr double kSamePose = 0.04;   // displacement / diameter up to which two candidates are one
constexpr double kSamePlace = 0.35;  // distance of the centres / diameter from which they are two placements

double distance_of_centres_mm(const Candidate& a, const Candidate& b, const model::PreparedModel& model) {
  const Eigen::Vector3d centre = model.box.center();
  return (a.model_from_scan.inverse() * centre - b.model_from_scan.inverse() * centre).norm();
}

// Score, normals, fit and rims are nearly independent witnesses, so a pose that is mediocre in all is less credible
// than one that is weak in a single one. 1 for a perfect pose; residuals strewn evenly over the band bring it to 0.
double proof(const Candidate& c) {
  const double evenly_strewn = 1.0 / std::sqrt(3.0);
  return c.score * c.normal_agreement * std::max(0.0, 1.0 - c.residual_ratio / evenly_strewn) * (1.0 - c.overrun_share);
}

bool surface_holds(const Candidate& c, const VerifyOptions& options) {
  return std::max(c.weakest_direction, c.weakest_but_near) >= hold_needed(c.missing_share, options);
}

// What others hide and what returned nothing can lie, anything next to an edge can feign it, and without rays little can
// be refuted, so that what was found must prove the more.
double proof_needed(const Candidate& c, const VerifyOptions& options) {
  return options.min_proof + options.hidden_surcharge * c.hidden_share + options.missing_surcharge * c.missing_share +
         (surface_holds(c, options) ? 0.0 : options.edges_surcharge) +
         (c.without_rays ? options.no_rays_surcharge : 0.0);
}

// The more poses are tried, the sooner one of them passes by chance: of many, one that is not proved far beyond what is
// asked for may be denied but half as much.
double contradictions_allowed(const Candidate& c, const VerifyOptions& options) {
  constexpr double kOfMany = 0.5, kFarBeyond = 1.5;
  const bool is_doubtful = options.is_one_of_many && proof(c) < kFarBeyond * proof_needed(c, options);
  return (is_doubtful ? kOfMany : 1.0) * options.max_contradiction_share;
}

// Where only the edges hold a pose, anything that lies next to them can feign its place: more is asked for than where
// the surface does, the more so the more ways there are to slip, and less may speak against it. Without rays nothing
// tells what the sensor looked past, which is most of what an edge can show.
double edge_measurements_needed(const Candidate& c, const VerifyOptions& options, int loose_directions) {
  constexpr double kShare = 0.006;  // of the measurements explained
  constexpr double kFurtherDirection = 0.75, kWithoutRays = 6.0;
  const double directions = 1.0 + kFurtherDirection * std::max(0, loose_directions - 1);
  // What returned nothing shows neither edges nor that there are none.
  const double unseen = 1.0 + 2.0 * options.missing_hold_surcharge * c.missing_share;
  const double needed = directions * unseen * std::max(0.9 * options.min_contrast, kShare * c.explained_measurements);
  return c.without_rays ? kWithoutRays * needed : needed;
}

double edge_measurements_needed(const Candidate& c, const VerifyOptions& options) {
  return edge_measurements_needed(c, options, c.loose_directions);
}

// Three faces that meet in a corner are those of a block of any size: there its far edges must tell the size, as edges
// tell where a loose part stands.
double size_measurements_needed(const Candidate& c, const VerifyOptions& options) {
  return edge_measurements_needed(c, options, 1);
}

bool is_of_this_size(const Candidate& c, const VerifyOptions& options) {
  return c.size_hold >= hold_needed(c.missing_share, options) || c.size_lead >= size_measurements_needed(c, options);
}

// Of a single flat face, only the outline tells the part from others with such a face, its mirror image among them: the
// face must be a good deal of the part, as it is of a plate.
bool is_a_mere_face(const Candidate& c) {
  constexpr int kOfAPlane = 3;
  constexpr double kLeastFacing = 0.35;
  return c.loose_directions >= kOfAPlane && c.facing_share < kLeastFacing;
}

bool is_held_by_edges(const Candidate& c, const VerifyOptions& options) {
  return !is_a_mere_face(c) && c.slip_lead >= edge_measurements_needed(c, options) &&
         c.contradiction_share <= 0.75 * contradictions_allowed(c, options);
}

// Details that break a near-symmetry are few among all samples, so their mean says little; the turn is held if they are
// enough by themselves. What is further off than they reach, the near poses and their contrast tell.
bool is_held(const Candidate& c, const VerifyOptions& options) {
  constexpr double kEnough = 1.0;  // samples that look along the turn, at half a diameter from the axis
  const bool holds_turn = c.weakest_direction * c.explained_samples >= kEnough;
  const double needed = hold_needed(c.missing_share, options);
  return c.weakest_direction >= needed || is_held_by_edges(c, options) || (c.weakest_but_near >= needed && holds_turn);
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
  const double most_contradictions = contradictions_allowed(c, options);
  if (!options.paper_mode && c.contradiction_share > most_contradictions) {
    return {Reason::contradicted,
            fmt::format("the scan denies {:.1f} % of the claimed surface, at most {:.1f} % are allowed",
                        100.0 * c.contradiction_share, 100.0 * most_contradictions)};
  }
  if (!options.paper_mode && c.overrun_share > options.max_overrun_share) {
    return {
        Reason::contradicted,
        fmt::format("the surface goes on past {:.0f} % of the part's edges, at most {:.0f} % are allowed: it belongs "
                    "to something larger",
                    100.0 * c.overrun_share, 100.0 * options.max_overrun_share)};
  }
  // Each share within its limit, but both near it.
  if (!options.paper_mode &&
      c.contradiction_share * options.max_overrun_share + c.overrun_share * most_contradictions >
          options.max_joint_denial * options.max_overrun_share * most_contradictions) {
    return {Reason::contradicted,
            fmt::format("the scan denies {:.1f} % of the claimed surface, and the surface goes on past {:.0f} % of the "
                        "part's edges: each is allowed, but not both",
                        100.0 * c.contradiction_share, 100.0 * c.overrun_share)};
  }
  if (!options.paper_mode && !is_held(c, options) && is_a_mere_face(c)) {
    return {Reason::under_constrained,
            fmt::format("one flat face is all that was found; it makes up {:.0f} % of the part, too little for its "
                        "outline to prove a pose",
                        100.0 * c.facing_share)};
  }
  if (!options.paper_mode && !is_held(c, options)) {
    return {Reason::under_constrained,
            fmt::format("the surface that was found would let the part slide or turn (weakest direction {:.4f}, {:.4f} "
                        "needed), and {:.0f} measurements at its edges hold it ({:.0f} needed)",
                        c.weakest_direction, hold_needed(c.missing_share, options), std::max(0.0, c.slip_lead),
                        edge_measurements_needed(c, options))};
  }
  if (!options.paper_mode && !is_of_this_size(c, options)) {
    return {Reason::under_constrained,
            fmt::format("the part in another size would lie on the surface that was found as well (its size is "
                        "held by {:.4f}, {:.4f} needed), and {:.0f} measurements at its edges tell ({:.0f} needed)",
                        c.size_hold, hold_needed(c.missing_share, options), std::max(0.0, c.size_lead),
                        size_measurements_needed(c, options))};
  }
  if (!options.paper_mode && c.lost_end_share > options.max_lost_end_share) {
    return {Reason::under_constrained,
            fmt::format("where the part should end, nothing came back from {:.1f} % of what was looked at, at most {:.1f} "
                        "% are allowed: something shorter would look the same",
                        100.0 * c.lost_end_share, 100.0 * options.max_lost_end_share)};
  }
  if (!options.paper_mode && c.pierced_share > options.max_pierced_share) {
    return {Reason::under_constrained,
            fmt::format("{:.0f} % of the part would lie behind a flat surface that is not its own, through which it "
                        "would have to reach (at most {:.0f} % are allowed where edges hold the pose or the size)",
                        100.0 * c.pierced_share, 100.0 * options.max_pierced_share)};
  }
  if (c.normal_agreement < options.min_normal_agreement) {
    return {Reason::normals_disagree, fmt::format("{:.0f} % of the normals agree with the model, {:.0f} % are needed",
                                                  100.0 * c.normal_agreement, 100.0 * options.min_normal_agreement)};
  }
  const double needed = proof_needed(c, options);
  if (!options.paper_mode && proof(c) < needed) {
    return {Reason::weak_evidence,
            fmt::format("score {:.2f}, normals {:.2f} and scatter {:.2f} together prove {:.2f}, {:.2f} are needed",
                        c.score, c.normal_agreement, c.residual_ratio, proof(c), needed)};
  }
  return {};
}

bool refutes(Reason objection) {
  switch (objection) {
    case Reason::low_score:
    case Reason::free_space_violated:
    case Reason::contradicted:
    case Reason::poor_fit:
    case Reason::normals_disagree:
      return true;
    default:
      return false;
  }
}

// Whether it clears every limit by so much that a search of the whole scan could not unsettle it.
bool is_beyond_doubt(const Candidate& c, const VerifyOptions& options) {
  constexpr double kProofToSpare = 0.12, kHalf = 0.5, kTwice = 2.0;
  const bool is_held_firmly = c.weakest_direction >= kTwice * hold_needed(c.missing_share, options) ||
                              c.slip_lead >= kTwice * edge_measurements_needed(c, options);
  const bool is_surely_of_this_size = c.size_hold >= kTwice * hold_needed(c.missing_share, options) ||
                                      c.size_lead >= kTwice * size_measurements_needed(c, options);
  return objection(c, options).reason == Reason::none && is_held_firmly && is_surely_of_this_size &&
         proof(c) >= proof_needed(c, options) + kProofToSpare &&
         c.contradiction_share <= kHalf * contradictions_allowed(c, options) &&
         c.overrun_share <= kHalf * options.max_overrun_share;
}

// One flat face between edges fits other things too, now and then: that is no second part, and no better one, beside a
// pose that the surface holds beyond doubt.
bool is_outshone(const Candidate& c, const Candidate& other, const VerifyOptions& options) {
  return c.weakest_direction < hold_needed(c.missing_share, options) && !is_beyond_doubt(c, options) &&
         other.weakest_direction >= hold_needed(other.missing_share, options) && is_beyond_doubt(other, options);
}

enum class Outcome { first, second, undecided };

Outcome winner(const PoseContrast& contrast, const VerifyOptions& options) {
  const double lead = contrast.for_first - contrast.for_second;
  if (std::abs(lead) < options.min_contrast) return Outcome::undecided;
  if (std::max(contrast.for_first, contrast.for_second) < options.min_contrast_share * contrast.total()) {
    return Outcome::undecided;
  }
  return lead > 0.0 ? Outcome::first : Outcome::second;
}

double turn_deg(const Candidate& a, const Candidate& b) {
  return rotation_angle(a.model_from_scan.linear() * b.model_from_scan.linear().transpose()) * 180.0 / std::numbers::pi;
}

Finding too_alike(const Candidate& best, const Candidate& rival, const std::optional<PoseContrast>& contrast,
                  const model::PreparedModel& model, const VerifyOptions& options) {
  const double apart = displacement_modulo_mm(best.model_from_scan, rival.model_from_scan, model);
  if (contrast && contrast->total() < options.min_contrast) {
    return {Reason::ambiguous_pose,
            fmt::format("the scan does not show what tells the pose from one that is turned by {:.0f} degrees and "
                        "differs by up to {:.1f} mm: {:.0f} measurements there, {:.0f} are needed",
                        turn_deg(best, rival), apart, contrast->total(), options.min_contrast)};
  }
  std::string where_they_differ;
  if (contrast) {
    where_they_differ = fmt::format("; where the two differ, {:.0f} measurements speak for it and {:.0f} for the other",
                                    contrast->for_first, contrast->for_second);
  }
  return {Reason::ambiguous_pose,
          fmt::format("a pose that differs by up to {:.1f} mm explains the scan about as well: score {:.3f} beside "
                      "{:.3f}{}",
                      apart, rival.score, best.score, where_they_differ)};
}

// Different poses in the same place that would be accepted too: what both predict supports both, so only the rest
// counts. The one that wins there goes to the front, also against a small lead in support.
void put_winner_first(std::vector<Candidate>& candidates, const model::PreparedModel& model,
                      const VerifyOptions& options, const Comparison& compare) {
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const Candidate &best = candidates.front(), &rival = candidates[i];
    const bool is_close = best.support - rival.support < options.min_margin * best.support;
    if (!is_close || !is_in_one_place(best, rival, model)) continue;
    if (objection(rival, options).reason != Reason::none || !is_comparable(rival, best)) continue;
    if (winner(compare(best, rival), options) != Outcome::second) continue;
    std::rotate(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(i),
                candidates.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
}

// A pose beyond doubt goes before one that is not and that only edges hold, whatever their supports.
void put_clear_first(std::vector<Candidate>& candidates, const VerifyOptions& options) {
  const auto clear = std::ranges::find_if(candidates, [&](const Candidate& other) {
    return is_comparable(other, candidates.front()) && is_outshone(candidates.front(), other, options);
  });
  if (clear != candidates.end()) std::rotate(candidates.begin(), clear, clear + 1);
}

// Two poses that put the surface at the same places but for less than parts deviate by: where the scan does not tell
// them apart, the pose is known modulo the motion between them.
bool are_nearly_equal(const Pose& a_from_scan, const Pose& b_from_scan, const model::PreparedModel& model,
                      const VerifyOptions& options) {
  return surface_moved_mm(a_from_scan * b_from_scan.inverse(), model) <= options.near_equal_ratio * model.diameter;
}

// A different pose that would itself be accepted and that nothing tells from the best.
Finding rivalry(const std::vector<Candidate>& candidates, const model::PreparedModel& model,
                const VerifyOptions& options, const Comparison& compare, bool one_of_several) {
  const Candidate& best = candidates.front();
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const Candidate& rival = candidates[i];
    if (objection(rival, options).reason != Reason::none || !is_comparable(rival, best)) continue;
    if (!is_in_one_place(best, rival, model)) {
      if (one_of_several || is_outshone(rival, best, options)) continue;
      return {Reason::second_instance, second_instance_sentence(best, rival, model)};
    }
    std::optional<PoseContrast> contrast;
    if (compare) contrast = compare(best, rival);
    const Outcome outcome = contrast ? winner(*contrast, options) : Outcome::undecided;
    // Along what hardly more than edges hold, a little more surface is found at a wrong pose as easily as at the right
    // one.
    constexpr double kTwice = 2.0;
    const bool is_firm = best.weakest_direction >= kTwice * hold_needed(best.missing_share, options);
    // What one pose explains and the other does not would have a vote. Without any, a lead in support comes of samples
    // that both explain, one where there are more points than the other: it says nothing.
    constexpr double kAny = 0.25;
    const bool is_told = !contrast || contrast->total() >= kAny * options.min_contrast;
    const bool leads = is_firm && is_told && best.support - rival.support >= options.min_margin * best.support;
    if (outcome == Outcome::undecided &&
        are_nearly_equal(best.model_from_scan, rival.model_from_scan, model, options)) {
      continue;
    }
    if (outcome == Outcome::second || (outcome == Outcome::undecided && !leads)) {
      return too_alike(best, rival, contrast, model, options);
    }
  }
  return {};
}

// Whether it is loose in nothing but turns about the part's axes of near-symmetry.
bool is_loose_in_turn_only(Candidate c, const VerifyOptions& options) {
  if (options.paper_mode || c.weakest_but_near < hold_needed(c.missing_share, options)) return false;
  c.weakest_direction = c.weakest_but_near;
  return objection(c, options).reason == Reason::none;
}

std::string acceptance(const Candidate& best, const model::PreparedModel& model, const VerifyOptions& options) {
  const std::string found = fmt::format("{:.0f} % of what should be visible was found, {:.0f} % of the normals agree",
                                        100.0 * best.score, 100.0 * best.normal_agreement);
  if (options.paper_mode || model.symmetry.is_trivial()) return found;
  return fmt::format("{}; the pose is known modulo the part's symmetry ({})", found, model.symmetry.describe());
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
    case Reason::mirror_image:
      return "mirror_image";
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

double hold_needed(double missing_share, const VerifyOptions& options) {
  return options.min_weakest_direction * (1.0 + options.missing_hold_surcharge * missing_share);
}

double displacement_mm(const Pose& a_from_scan, const Pose& b_from_scan, const model::PreparedModel& model) {
  return model::largest_displacement_mm(b_from_scan * a_from_scan.inverse(), model.box);
}

double displacement_modulo_mm(const Pose& a_from_scan, const Pose& b_from_scan, const model::PreparedModel& model) {
  return model::displacement_modulo_mm(b_from_scan * a_from_scan.inverse(), model.symmetry, model.box);
}

std::vector<Candidate> best_different(std::vector<Candidate> candidates, std::size_t most, double least_apart_mm,
                                      const model::PreparedModel& model, const VerifyOptions& options) {
  const auto apart = options.paper_mode ? displacement_mm : displacement_modulo_mm;
  std::ranges::stable_sort(candidates, std::ranges::greater{}, &Candidate::support);
  std::vector<Candidate> kept;
  for (const Candidate& candidate : candidates) {
    const auto same = std::ranges::find_if(kept, [&](const Candidate& other) {
      return apart(other.model_from_scan, candidate.model_from_scan, model) <= least_apart_mm;
    });
    if (same != kept.end()) {
      same->votes = std::max(same->votes, candidate.votes);
    } else if (kept.size() < most) {
      kept.push_back(candidate);
    }
  }
  return kept;
}

bool is_comparable(const Candidate& rival, const Candidate& best) {
  constexpr double kProofShare = 0.75, kSupportShare = 0.25;
  return proof(rival) >= kProofShare * proof(best) && rival.support >= kSupportShare * best.support;
}

bool is_beyond_doubt(const Detection& detection, const VerifyOptions& options) {
  return detection.status == Status::accepted && !options.paper_mode && is_beyond_doubt(detection.best, options);
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

std::vector<Candidate> without_beaten_at_edges(std::vector<Candidate> candidates, const model::PreparedModel& model,
                                               const VerifyOptions& options, const Comparison& compare) {
  constexpr double kLeastLead = 2.0;  // measurements
  if (options.paper_mode) return candidates;
  std::ranges::stable_sort(candidates, std::ranges::greater{}, &Candidate::support);
  const std::size_t count = candidates.size();
  std::vector<std::uint8_t> takes_part(count), is_beaten(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    takes_part[i] = !surface_holds(candidates[i], options) && objection(candidates[i], options).reason == Reason::none;
  }
  for (std::size_t first = 0; first < count; ++first) {
    if (!takes_part[first] || is_beaten[first]) continue;
    const auto is_rival = [&](std::size_t i) {
      return takes_part[i] && !is_beaten[i] &&
             displacement_modulo_mm(candidates[first].model_from_scan, candidates[i].model_from_scan, model) <=
                 kSamePose * model.diameter;
    };
    std::size_t leader = first;
    for (std::size_t i = first + 1; i < count; ++i) {
      if (!is_rival(i)) continue;
      const PoseContrast seen = compare(candidates[leader], candidates[i]);
      if (seen.for_second - seen.for_first > kLeastLead) leader = i;
    }
    for (std::size_t i = first; i < leader; ++i) {
      if (is_rival(i)) is_beaten[i] = 1;
    }
  }
  std::vector<Candidate> kept;
  for (std::size_t i = 0; i < count; ++i) {
    if (!is_beaten[i]) kept.push_back(candidates[i]);
  }
  return kept;
}

Detection decide(std::vector<Candidate> candidates, const model::PreparedModel& model, const VerifyOptions& options,
                 const Comparison& compare, bool one_of_several) {
  Detection detection;
  if (candidates.empty()) {
    detection.explanation = "no pose of the part was proposed";
    return detection;
  }
  detection.candidates =
      best_different(std::move(candidates), kMostCandidates, kSamePose * model.diameter, model, options);
  for (Candidate& candidate : detection.candidates) candidate.objection = objection(candidate, options).reason;
  // A pose that the scan refutes is no rival to one that it does not; one that merely lacks proof still is.
  if (!options.paper_mode) {
    std::ranges::stable_partition(detection.candidates, [](const Candidate& c) { return !refutes(c.objection); });
  }
  if (!options.paper_mode) put_clear_first(detection.candidates, options);
  const bool is_good = detection.candidates.front().objection == Reason::none;
  if (is_good && compare && !options.paper_mode) put_winner_first(detection.candidates, model, options, compare);
  detection.best = detection.candidates.front();
  detection.margin = detection.best.support - (detection.candidates.size() > 1 ? detection.candidates[1].support : 0.0);

  Finding finding = objection(detection.best, options);
  const bool turn_is_unknown =
      finding.reason == Reason::under_constrained && is_loose_in_turn_only(detection.best, options);
  if (turn_is_unknown && !turns_are_nearly_equal(model, options.near_equal_ratio)) {
    detection.status = Status::ambiguous;
    detection.reason = Reason::ambiguous_pose;
    detection.explanation =
        "the scan does not show what tells the part's turns about its axis of near-symmetry from one another";
    return detection;
  }
  if (turn_is_unknown) {
    detection.best.objection = detection.candidates.front().objection = Reason::none;
    finding = {};
  }
  if (finding.reason != Reason::none) {
    detection.reason = finding.reason;
    detection.explanation = std::move(finding.explanation);
    return detection;
  }
  if (!options.paper_mode) finding = rivalry(detection.candidates, model, options, compare, one_of_several);
  detection.reason = finding.reason;
  detection.status = finding.reason == Reason::none ? Status::accepted : Status::ambiguous;
  detection.explanation =
      finding.reason == Reason::none ? acceptance(detection.best, model, options) : std::move(finding.explanation);
  if (detection.status == Status::accepted && turn_is_unknown) {
    detection.explanation += fmt::format(
        "; its turn about the part's axis is not known, but moves no surface by more than {:.1f} % of the diameter",
        100.0 * options.near_equal_ratio);
  }
  return detection;
}

}  // namespace asbuilt::verify
