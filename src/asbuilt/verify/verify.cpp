// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "asbuilt/core/option_check.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/verify/contrast.h"
#include "asbuilt/verify/evidence.h"
#include "asbuilt/verify/lm_icp.h"
#include "asbuilt/verify/lost_end.h"
#include "asbuilt/verify/near_poses.h"
#include "asbuilt/verify/pierced_plane.h"
#include "asbuilt/verify/rim.h"
#include "asbuilt/verify/segment.h"
#include "asbuilt/verify/size.h"
#include "asbuilt/verify/slip.h"
#include "asbuilt/verify/verdict.h"

namespace asbuilt::verify {
namespace {

// Log odds: a contradiction is rare at a right pose and common at a wrong one; agreement is common at both.
constexpr double kContradictionWeight = 3.0;

// Of the diameter. A pose that could be displaced so far unnoticed is not known.
constexpr double kSlips[] = {0.03, 0.1};
// Where other things feign the part's edges, the right pose may be further along.
constexpr double kFarSlips[] = {0.06, 0.12, 0.18, 0.24};
constexpr double kSamePlace = 0.03;  // a slip that registration takes back so far is none

// Edges are read to within so many times the scatter of the points on the model, but to no less than a share of the
// distance that counts as on it.
constexpr double kEdgeScatter = 4.0, kFinestEdge = 0.3;

// Of the diameter: how far past its edges the part's surface must not go on.
constexpr double kRimReach = 0.03;
constexpr std::size_t kMostRimSamples = 3000, kFewRimProbes = 200, kSomeRimProbes = 600;

constexpr double kLittle = 0.3;      // of the largest support
constexpr double kClearly = 2.0;     // times the contradictions allowed: such a pose is wrong, even if not yet precise
constexpr double kPlausible = 0.75;  // of the score that is needed: where it pays to look for a better place

constexpr double kSamePose = 0.01;  // displacement / diameter up to which two candidates need not both go on
constexpr std::size_t kAll = std::numeric_limits<std::size_t>::max();

/// One level of the coarse-to-fine pyramid (Sec. 3.1: three of them).
struct Level {
  double spacing_mm;                      ///< of the scan points used
  std::array<double, 2> robust_scale_mm;  ///< of the two passes; of the last level, no less than what counts as on it
  double least_score_distance_mm;         ///< but no less than what counts as on the model
  std::size_t most_points;                ///< scan points that a registration takes, spread over the part
  std::size_t most_samples;               ///< model samples that are asked for evidence, likewise
  std::size_t survivors;                  ///< candidates that reach the next level
  const PointCloud* model_samples;
  double contradiction_weight;  ///< a right pose has few contradictions, once it is precise
  std::size_t most_rim_probes;  ///< at the part's edges, where its surface must not go on
  bool is_precise;              ///< poses are, so that contradictions refute
  bool is_finest = false;
};

// The published judge knows one spacing a scan.
double spacing_around(const Pose& model_from_scan, const model::PreparedModel& model, const scan::Scan& scan,
                      const VerifyOptions& options) {
  return options.paper_mode ? scan.spacing_mm : spacing_at(model_from_scan, model, scan);
}

double score_distance(const scan::Scan& scan, double spacing_mm, const model::PreparedModel& model,
                      const VerifyOptions& options) {
  const double sensor = options.score_distance_mm > 0.0 ? options.score_distance_mm
                                                        : std::max(3.0 * scan.noise_sigma_mm, 0.5 * spacing_mm);
  return options.paper_mode ? sensor : sensor + options.deviation_ratio * model.diameter;
}

// What counts as on the model where a pose puts it.
double score_distance_at(const Pose& model_from_scan, const scan::Scan& scan, const model::PreparedModel& model,
                         const VerifyOptions& options) {
  return score_distance(scan, spacing_around(model_from_scan, model, scan, options), model, options);
}

// Floors, walls and tables larger than the part would lend their points to any flat face of it.
std::vector<std::uint8_t> background_of(const scan::Scan& scan, const model::PreparedModel& model,
                                        const VerifyOptions& options, const Context& context,
                                        const detect::SampledScan* sampled) {
  if (options.paper_mode) return std::vector<std::uint8_t>(scan.cloud.size(), 0);
  if (sampled != nullptr) return detect::points_on_large_planes(scan, *sampled, context);
  return detect::points_on_large_planes(
      scan, detect::sampled_scan(scan, model.sampling_distance, model.diameter, context), context);
}

std::vector<std::uint8_t> with(std::span<const std::uint8_t> taken, std::vector<std::uint8_t> background) {
  for (std::size_t i = 0; i < taken.size(); ++i) background[i] |= taken[i];
  return background;
}

// The more hypotheses are tried, the sooner one of them passes by chance.
VerifyOptions limits_of(VerifyOptions options, Look look) {
  constexpr double kOfMany = 0.5;
  if (look != Look::patient) return options;
  options.is_one_of_many = true;
  options.max_overrun_share *= kOfMany;
  return options;
}

// A quick look carries fewer candidates along: what it does not settle is looked at again.
// The published pyramid takes all points and samples of a level; ours no more than a pose needs.
std::array<Level, 3> pyramid(const model::PreparedModel& model, Look look, bool paper_mode) {
  const auto most = [&](std::size_t ours) { return paper_mode ? std::numeric_limits<std::size_t>::max() : ours; };
  const double d = model.sampling_distance;
  const std::size_t third = look == Look::quick ? 4 : look == Look::thorough ? 8 : 16;
  const std::size_t second = 2 * third, first = look == Look::quick ? 16 : look == Look::thorough ? 40 : 160;
  const Level coarse{.spacing_mm = 0.8 * d,
                     .robust_scale_mm = {2.0 * d, d},
                     .least_score_distance_mm = 0.5 * d,
                     .most_points = most(500),
                     .most_samples = most(500),
                     .survivors = first,
                     .model_samples = &model.samples,
                     .contradiction_weight = 1.0,
                     .most_rim_probes = kFewRimProbes,
                     .is_precise = false};
  const Level middle{.spacing_mm = 0.5 * d,
                     .robust_scale_mm = {0.7 * d, 0.4 * d},
                     .least_score_distance_mm = 0.25 * d,
                     .most_points = most(1000),
                     .most_samples = most(1000),
                     .survivors = second,
                     .model_samples = &model.samples,
                     .contradiction_weight = 2.0,
                     .most_rim_probes = kSomeRimProbes,
                     .is_precise = true};
  const Level fine{.spacing_mm = 0.3 * d,
                   .robust_scale_mm = {0.25 * d, 0.15 * d},
                   .least_score_distance_mm = 0.0,
                   .most_points = most(3000),
                   .most_samples = most(3000),
                   .survivors = third,
                   .model_samples = &model.dense_samples,
                   .contradiction_weight = kContradictionWeight,
                   .most_rim_probes = kSomeRimProbes,
                   .is_precise = true,
                   .is_finest = true};
  return {coarse, middle, fine};
}

Segment segment_at(const Pose& model_from_scan, const scan::Scan& scan, const model::PreparedModel& model,
                   const std::vector<std::uint8_t>& background, double score_distance_mm, const Context& context) {
  const SegmentOptions segmentation{std::max(score_distance_mm, 0.0075 * model.diameter), 0.03 * model.diameter, 0.8};
  return segment_part(model_from_scan, model, scan, background, segmentation, context);
}

// In random order, so that the first few of any region are spread over it.
std::vector<Eigen::Vector3f> shuffled(std::vector<Eigen::Vector3f> points) {
  Random random(0, "registration points", points.size());
  for (std::size_t i = points.size(); i > 1; --i) std::swap(points[i - 1], points[random.below(i)]);
  return points;
}

// The first `most` of the points that lie within `margin_mm` of the model's surface at a pose.
std::vector<Eigen::Vector3f> points_around(const std::vector<Eigen::Vector3f>& points, const Pose& model_from_scan,
                                           const model::PreparedModel& model, double margin_mm, std::size_t most) {
  const Eigen::Vector3f centre = (model_from_scan.inverse() * model.box.center().eval()).cast<float>();
  const auto radius = static_cast<float>(0.5 * model.diameter + margin_mm);
  const Eigen::Matrix3f rotation = model_from_scan.linear().cast<float>();
  const Eigen::Vector3f translation = model_from_scan.translation().cast<float>();
  std::vector<Eigen::Vector3f> around;
  for (const Eigen::Vector3f& point : points) {
    if ((point - centre).squaredNorm() > radius * radius) continue;
    if (!(std::abs(model.field->distance_at(rotation * point + translation)) <= static_cast<float>(margin_mm)))
      continue;
    around.push_back(point);
    if (around.size() == most) break;
  }
  return around;
}

std::vector<Eigen::Vector3f> level_points(const scan::Scan& scan, double spacing_mm, const Context& context) {
  if (spacing_mm <= scan.spacing_mm) return shuffled(scan.cloud.positions);
  std::vector<Eigen::Vector3f> points;
  for (const std::uint32_t i : even_subset(scan.cloud.positions, spacing_mm, context)) {
    points.push_back(scan.cloud.positions[i]);
  }
  return shuffled(std::move(points));
}

void take_evidence(Candidate& candidate, const PoseEvidence& evidence, const model::PreparedModel& model,
                   double contradiction_weight) {
  candidate.score = evidence.score();
  candidate.visible_share = evidence.visible_share();
  candidate.free_space_violations = evidence.free_space_share();
  candidate.hidden_share = evidence.facing > 0.0 ? evidence.hidden / evidence.facing : 0.0;
  candidate.explained_samples = static_cast<int>(evidence.explained_samples);
  candidate.weakest_direction = weakest_direction(evidence, model, false);
  candidate.weakest_but_near = weakest_direction(evidence, model, true);
  const double denied = evidence.contradicted + evidence.seen_through;
  const double asked = evidence.facing - evidence.hidden;
  candidate.contradiction_share = asked > 0.0 ? denied / asked : 0.0;
  candidate.found_share = asked > 0.0 ? evidence.explained / asked : 0.0;
  candidate.missing_share = asked > 0.0 ? evidence.missing / asked : 0.0;
  candidate.facing_share = static_cast<double>(evidence.facing_samples) / static_cast<double>(evidence.samples);
  candidate.support = evidence.support(contradiction_weight);
}

}  // namespace

// What a scan is asked by, whatever the question.
struct Judge::Material {
  Material(const scan::Scan& the_scan, const model::PreparedModel& the_model, const VerifyOptions& the_options,
           const Context& the_context, std::span<const std::uint8_t> taken, const detect::SampledScan* sampled)
      : scan(the_scan),
        model(the_model),
        options(the_options),
        context(the_context),
        background(background_of(scan, model, options, context, sampled)),
        evidence(scan, with(taken, background), context),
        shuffled_foreground(shuffled(evidence.foreground.cloud.positions)),
        rim_reach(std::max(kRimReach * model.diameter, 2.0 * score_distance(scan, scan.spacing_mm, model, options))),
        rim_probes(verify::rim_probes(model, rim_reach, kMostRimSamples)),
        one_of_several(!taken.empty()) {}

  const scan::Scan& scan;
  const model::PreparedModel& model;
  const VerifyOptions& options;
  const Context& context;
  std::vector<std::uint8_t> background;
  ScanEvidence evidence;
  std::vector<Eigen::Vector3f> shuffled_foreground;
  double rim_reach;
  std::vector<RimProbe> rim_probes;
  bool one_of_several;
};

class Judge::Verification {
 public:
  Verification(const Material& material, Look look)
      : scan_(material.scan),
        model_(material.model),
        options_(limits_of(material.options, look)),
        context_(material.context),
        background_(material.background),
        evidence_(material.evidence),
        shuffled_foreground_(material.shuffled_foreground),
        rim_reach_(material.rim_reach),
        rim_probes_(material.rim_probes),
        one_of_several_(material.one_of_several) {}

  [[nodiscard]] Result<Detection> verdict_on(std::vector<Candidate> candidates, Look look, bool accept_anyway) const;

  // Sparse registration of all candidates, score, the best go on; three times (Sec. 3.1).
  [[nodiscard]] std::vector<Candidate> coarse_to_fine(std::vector<Candidate> candidates, Look look) const {
    for (const Level& level : pyramid(model_, look, options_.paper_mode)) {
      const std::vector<Eigen::Vector3f> points = level_points(evidence_.foreground, level.spacing_mm, context_);
      parallel_for(context_, candidates.size(), 1, [&](std::size_t i) {
        if (!context_.cancelled()) refine_at(level, points, candidates[i]);
      });
      candidates = survivors_of(level, std::move(candidates));
    }
    return candidates;
  }

  // Detection may have taken the part for one of its near-symmetric poses, so the best bring theirs along. Those that
  // stand up to a first look are registered and judged as all others. Says whether there are any.
  [[nodiscard]] bool add_near_poses(std::vector<Candidate>& candidates) const {
    constexpr std::size_t kMostNear = 8;
    constexpr double kPromisingShare = 0.7;  // of the best support
    std::vector<Candidate> near = near_candidates(candidates);
    if (near.empty()) return false;
    const double best_support = candidates.front().support;
    const Level level = pyramid(model_, Look::thorough, options_.paper_mode).back();
    const std::vector<Eigen::Vector3f> points = level_points(evidence_.foreground, level.spacing_mm, context_);
    parallel_for(context_, near.size(), 1, [&](std::size_t i) {
      if (!context_.cancelled()) refine_at(level, points, near[i]);
    });
    std::erase_if(near, [&](const Candidate& c) { return c.support < kPromisingShare * best_support; });
    if (near.empty()) return false;
    const double apart = kSamePose * model_.diameter;
    near = best_different(std::move(near), kMostNear, apart, model_, options_);
    candidates.insert(candidates.end(), near.begin(), near.end());
    candidates = best_different(std::move(candidates), kAll, apart, model_, options_);
    put_refuted_last(level, candidates);
    return true;
  }

  // A pose that only edges hold is not accepted before those that put another side of the part in its place have been
  // judged: detection need not have proposed them, and of the best by support others may have been in front of it. Adds
  // them to the judged `candidates`; says whether there are any.
  [[nodiscard]] bool add_attitudes_of(const Candidate& accepted, std::vector<Candidate>& candidates) const {
    if (options_.paper_mode || !is_loose(accepted)) return false;
    std::vector<Candidate> attitudes{accepted};
    if (!add_near_poses(attitudes)) return false;
    const double apart = kSamePose * model_.diameter;
    std::erase_if(attitudes, [&](const Candidate& c) {
      return displacement_modulo_mm(c.model_from_scan, accepted.model_from_scan, model_) < apart;
    });
    parallel_for(context_, attitudes.size(), 1, [&](std::size_t i) {
      if (!context_.cancelled()) register_densely(attitudes[i]);
    });
    candidates.insert(candidates.end(), attitudes.begin(), attitudes.end());
    candidates = best_different(std::move(candidates), kAll, apart, model_, options_);
    return !attitudes.empty();
  }

  // Candidates with so much less support than the first are neither its rivals (is_comparable) nor likely to take its
  // place. The first, which stays whatever its support, is not refuted, if any is not: put_refuted_last.
  [[nodiscard]] std::vector<Candidate> contenders(std::vector<Candidate> candidates) const {
    constexpr double kShare = 0.2;
    if (options_.paper_mode || candidates.empty()) return candidates;
    const double least = kShare * candidates.front().support;
    candidates.erase(
        std::remove_if(candidates.begin() + 1, candidates.end(), [&](const Candidate& c) { return c.support < least; }),
        candidates.end());
    return candidates;
  }

  // Before the last registration, which takes away what the group's own inexactness adds.
  void make_canonical(Candidate& candidate) const {
    if (!options_.paper_mode) candidate.model_from_scan = model_.symmetry.canonical(candidate.model_from_scan);
  }

  [[nodiscard]] PoseContrast contrast_of(const Candidate& first, const Candidate& second) const {
    return contrast(first.model_from_scan, second.model_from_scan, model_, evidence_,
                    evidence_options(first.model_from_scan));
  }

  // Dense registration, then the judges: evidence over dense samples, and the normals, left out until now.
  void register_densely(Candidate& candidate) const {
    make_canonical(candidate);
    const double final_distance = final_distance_at(candidate.model_from_scan);
    constexpr std::size_t kEnough = 8000;     // the noise of so many averages out below a field's voxel
    constexpr std::size_t kFewPoints = 2000;  // enough to come close
    const std::size_t most_points = options_.paper_mode ? std::numeric_limits<std::size_t>::max() : kEnough;
    constexpr int kFewIterations = 30, kManyIterations = 300;
    const std::vector<Eigen::Vector3f> around =
        points_around(shuffled_foreground_, candidate.model_from_scan, model_, 4.0 * final_distance, most_points);
    bool has_converged = false;
    const auto register_at = [&](double scale_mm, int most_iterations, std::size_t most) {
      const auto points = std::span(around).first(std::min(most, around.size()));
      const LmIcpResult result = lm_icp(points, candidate.model_from_scan, model_, scan_.viewpoint,
                                        {scale_mm, most_iterations, only_facing()});
      candidate.model_from_scan = result.model_from_scan;
      candidate.rms_mm = result.rms_mm;
      candidate.residual_ratio = result.rms_mm / final_distance;
      has_converged = result.iterations < most_iterations;
    };
    register_at(1.5 * final_distance, kFewIterations, kFewPoints);
    register_at(final_distance, kFewIterations, most_points);
    const EvidenceOptions options = evidence_options(candidate.model_from_scan);
    const auto judged_densely = [&] {
      return judge(candidate, model_.dense_samples, options_within(candidate.model_from_scan, final_distance),
                   kContradictionWeight);
    };
    PoseEvidence evidence = judged_densely();
    const auto is_plausible = [&] {
      return candidate.score >= kPlausible * options_.acceptance_score &&
             candidate.contradiction_share <= kClearly * options_.max_contradiction_share;
    };
    if (is_plausible() && !has_converged) {  // a wrong pose may take for ever, a right one must arrive
      register_at(final_distance, kManyIterations, most_points);
      evidence = judged_densely();
    }
    const auto is_loose = [&] {
      return !options_.paper_mode && candidate.weakest_direction < hold_needed(candidate.missing_share, options_);
    };
    const EvidenceOptions edge_options = options_at_edges(candidate);
    const auto settled = [&](const Pose& pose) {
      return settled_between_edges(pose, evidence, model_, hold_needed(candidate.missing_share, options_), evidence_,
                                   edge_options);
    };
    if (is_loose() && may_have_drifted(candidate)) {
      const Pose drifted = candidate.model_from_scan;
      candidate.model_from_scan = settled(drifted);
      if (candidate.model_from_scan.matrix() != drifted.matrix()) evidence = judged_densely();
    }
    candidate.without_rays = !options_.paper_mode && !scan_.viewpoint.known();
    if (candidate.without_rays && !model_.is_open()) judge_without_rays(candidate);
    constexpr int kMostMoves = 2;
    for (int move = 0; is_loose() && is_plausible(); ++move) {
      candidate.loose_directions = loose_directions(evidence, model_, hold_needed(candidate.missing_share, options_));
      const Slip rival = strongest_rival(candidate, evidence, around, edge_options);
      candidate.slip_lead = std::isfinite(rival.lead_over_it) ? rival.lead_over_it : 0.0;
      if (candidate.slip_lead >= 0.0 || move == kMostMoves) break;
      candidate.model_from_scan = settled(rival.model_from_scan);
      evidence = judged_densely();
      if (candidate.without_rays && !model_.is_open()) judge_without_rays(candidate);
    }
    candidate.explained_measurements =
        measurements_per_sample(model_, spacing_around(candidate.model_from_scan, model_, scan_, options_)) *
        candidate.explained_samples;
    candidate.overrun_share =
        rim_evidence(candidate.model_from_scan, rim_probes_, rim_reach_, evidence_, options).overrun_share();
    judge_normals(candidate);
    if (options_.paper_mode) return;
    const double hold = hold_needed(candidate.missing_share, options_);
    candidate.size_hold = size_hold(evidence);
    if (candidate.size_hold < hold && is_plausible()) {
      candidate.size_lead = size_lead(candidate.model_from_scan, evidence, model_, evidence_, edge_options);
    }
    if (scan_.viewpoint.known() && candidate.missing_share > options_.max_lost_end_share && is_plausible()) {
      candidate.lost_end_share = lost_end_share(candidate.model_from_scan, model_, evidence_, options);
    }
    if ((is_loose() || candidate.size_hold < hold) && is_plausible()) {
      candidate.pierced_share = pierced_share(candidate.model_from_scan, model_, scan_, final_distance);
    }
  }

  void cut_out(Detection& detection) const {
    const Pose& pose = detection.best.model_from_scan;
    Segment segment = segment_at(pose, scan_, model_, background_, final_distance_at(pose), context_);
    detection.segment = std::move(segment.part);
    detection.margin_points = std::move(segment.margin);
  }

 private:
  [[nodiscard]] bool is_loose(const Candidate& candidate) const {
    return candidate.weakest_direction < hold_needed(candidate.missing_share, options_);
  }

  // The near-symmetric poses of the best candidates; of the first, if it is loose, those in other attitudes too.
  [[nodiscard]] std::vector<Candidate> near_candidates(const std::vector<Candidate>& candidates) const {
    constexpr std::size_t kMostLeaders = 3, kMostPoints = 4000;
    constexpr double kLeaderShare = 0.7;  // of the best support
    std::vector<Candidate> near;
    if (options_.paper_mode || candidates.empty()) return near;
    const bool first_is_loose = is_loose(candidates.front());
    const std::size_t leaders = model_.symmetry.has_near() ? kMostLeaders : first_is_loose ? 1 : 0;
    for (std::size_t i = 0; i < std::min(leaders, candidates.size()); ++i) {
      if (candidates[i].support < kLeaderShare * candidates.front().support) break;
      const Pose& pose = candidates[i].model_from_scan;
      const double distance = final_distance_at(pose);
      const std::vector<Eigen::Vector3f> around =
          points_around(shuffled_foreground_, pose, model_, distance, kMostPoints);
      std::vector<Pose> poses = near_poses(pose, around, model_, distance);
      if (i == 0 && first_is_loose) {
        std::ranges::copy(turned_in_box(pose, around, model_, distance), std::back_inserter(poses));
      }
      for (const Pose& there : poses) {
        near.push_back(candidates[i]);
        near.back().model_from_scan = there;
      }
    }
    return near;
  }

  // Of the poses into which the part may have slipped that which comes closest, or one that explains the scan better.
  [[nodiscard]] Slip strongest_rival(const Candidate& candidate, const PoseEvidence& evidence,
                                     std::span<const Eigen::Vector3f> points_in_scan,
                                     const EvidenceOptions& edge_options) const {
    Slip strongest;
    ContrastOf contrast(candidate.model_from_scan, model_, evidence_, edge_options);
    const auto consider = [&](const Slip& slip) {
      if (slip.lead_over_it < strongest.lead_over_it) strongest = slip;
    };
    for (const double slip : kSlips) {
      consider(strongest_slip(candidate.model_from_scan, evidence, model_,
                              hold_needed(candidate.missing_share, options_), slip * model_.diameter, contrast));
    }
    if (strongest.lead_over_it > 0.0 && std::isfinite(strongest.lead_over_it)) {
      consider(strongest_far_slip(candidate, evidence, points_in_scan, contrast));
    }
    return strongest;
  }

  // The same over poses further along the loose directions, each brought onto the surface again.
  [[nodiscard]] Slip strongest_far_slip(const Candidate& candidate, const PoseEvidence& evidence,
                                        std::span<const Eigen::Vector3f> points_in_scan, ContrastOf& contrast) const {
    constexpr std::size_t kMostPoints = 2000;
    constexpr int kMostIterations = 20;
    const auto points = points_in_scan.first(std::min(kMostPoints, points_in_scan.size()));
    const Pose& model_from_scan = candidate.model_from_scan;
    const double scale_mm = 1.5 * final_distance_at(model_from_scan);
    Slip strongest;
    for (const double slip : kFarSlips) {
      for (const Pose& slipped :
           slipped_poses(model_from_scan, evidence, model_, hold_needed(candidate.missing_share, options_),
                         slip * model_.diameter, Slips::single)) {
        const Pose there = lm_icp(points, slipped, model_, scan_.viewpoint, {scale_mm, kMostIterations, only_facing()})
                               .model_from_scan;
        if (displacement_modulo_mm(model_from_scan, there, model_) <= kSamePlace * model_.diameter) continue;
        const PoseContrast seen = contrast.against(there);
        const double lead = seen.for_first - seen.for_second;
        if (lead < strongest.lead_over_it) strongest = {there, lead};
      }
    }
    return strongest;
  }

  // Registration drifts along loose directions, by what it takes for the part's side walls among other things. What it
  // drifted into then denies the pose, so much may do that.
  [[nodiscard]] bool may_have_drifted(const Candidate& candidate) const {
    constexpr double kMostDenied = 0.35;
    return candidate.score >= 0.5 * options_.acceptance_score && candidate.contradiction_share <= kMostDenied &&
           candidate.overrun_share <= kClearly * options_.max_overrun_share;
  }

  // Most places go to the best by support, those that lie on something larger than the part or are clearly denied
  // behind all others; the rest go to those with most votes: small views have little support, but may have many votes.
  [[nodiscard]] std::vector<Candidate> survivors_of(const Level& level, std::vector<Candidate> candidates) const {
    constexpr double kShareBySupport = 0.75;
    const double apart = kSamePose * model_.diameter;
    if (options_.paper_mode) return best_different(std::move(candidates), level.survivors, apart, model_, options_);
    candidates = best_different(std::move(candidates), kAll, apart, model_, options_);
    put_refuted_last(level, candidates);
    if (candidates.size() <= level.survivors) return candidates;
    const auto by_support = static_cast<std::ptrdiff_t>(kShareBySupport * static_cast<double>(level.survivors));
    std::stable_sort(candidates.begin() + by_support, candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.votes > b.votes; });
    candidates.resize(level.survivors);
    return candidates;
  }

  void put_refuted_last(const Level& level, std::vector<Candidate>& candidates) const {
    const auto probes = std::span(rim_probes_).first(std::min(level.most_rim_probes, rim_probes_.size()));
    parallel_for(context_, candidates.size(), 1, [&](std::size_t i) {
      Candidate& candidate = candidates[i];
      const EvidenceOptions options = evidence_options(candidate.model_from_scan, level.least_score_distance_mm);
      candidate.overrun_share =
          rim_evidence(candidate.model_from_scan, probes, rim_reach_, evidence_, options).overrun_share();
    });
    double most_support = 0.0;
    for (const Candidate& candidate : candidates) most_support = std::max(most_support, candidate.support);
    const auto doubts = [&](const Candidate& c) {
      if (c.overrun_share > kClearly * options_.max_overrun_share) return 2;
      if (!level.is_precise) return 0;
      if (c.contradiction_share > kClearly * options_.max_contradiction_share) return 2;
      const bool has_little = c.support < kLittle * most_support;
      return has_little || c.contradiction_share > options_.max_contradiction_share ? 1 : 0;
    };
    std::ranges::stable_sort(candidates, std::ranges::less{}, doubts);
  }

  void refine_at(const Level& level, const std::vector<Eigen::Vector3f>& points, Candidate& candidate) const {
    std::array<double, 2> scales = level.robust_scale_mm;
    if (level.is_finest) {
      for (double& scale : scales) scale = std::max(scale, final_distance_at(candidate.model_from_scan));
    }
    const std::vector<Eigen::Vector3f> around =
        points_around(points, candidate.model_from_scan, model_, 2.0 * scales[0], level.most_points);
    for (const double scale : scales) {
      candidate.model_from_scan =
          lm_icp(around, candidate.model_from_scan, model_, scan_.viewpoint, {scale, 10, only_facing()})
              .model_from_scan;
    }
    EvidenceOptions how = evidence_options(candidate.model_from_scan, level.least_score_distance_mm);
    how.most_samples = level.most_samples;
    judge(candidate, *level.model_samples, how, level.contradiction_weight);
  }

  // Walls turned away from the sensor hold no points; a sheet has no such side.
  [[nodiscard]] bool only_facing() const { return !options_.paper_mode && !model_.is_open(); }

  // Without a viewpoint no ray can contradict a pose, but points inside the solid do, and those that the sensor would
  // have to have seen through others.
  void judge_without_rays(Candidate& candidate) const {
    constexpr std::size_t kMostPoints = 8000;
    constexpr double kDepth = 0.1;  // of the diameter, how far from the surface points are asked
    const std::vector<Eigen::Vector3f> around =
        points_around(shuffled_foreground_, candidate.model_from_scan, model_, kDepth * model_.diameter, kMostPoints);
    const Pose& pose = candidate.model_from_scan;
    const EvidenceOptions options = evidence_options(pose);
    candidate.contradiction_share =
        std::max({candidate.contradiction_share, share_within(pose, around, model_, options.distance_mm),
                  share_seen_from_behind(pose, around, model_, evidence_, options)});
  }

  // The published judge asks every point; ours those whose normals mean something, and passes where there are none.
  void judge_normals(Candidate& candidate) const {
    constexpr std::size_t kMostPoints = 3000;
    const Pose& pose = candidate.model_from_scan;
    const NormalOptions options{final_distance_at(pose), options_.max_normal_angle_deg * std::numbers::pi / 180.0};
    if (options_.paper_mode) {
      candidate.normal_agreement = normal_agreement(pose, evidence_.foreground, model_, options);
      return;
    }
    const std::vector<Eigen::Vector3f> around =
        points_around(shuffled_foreground_, pose, model_, options.distance_mm, kMostPoints);
    candidate.normal_agreement =
        flat_normal_agreement(pose, around, evidence_, model_, options).value_or(options_.min_normal_agreement);
  }

  PoseEvidence judge(Candidate& candidate, const PointCloud& samples, const EvidenceOptions& how,
                     double contradiction_weight) const {
    const PoseEvidence evidence = evidence_for(candidate.model_from_scan, samples, model_, evidence_, how);
    take_evidence(candidate, evidence, model_, contradiction_weight);
    if (options_.paper_mode) candidate.score = candidate.support = candidate.visible_share;
    return evidence;
  }

  [[nodiscard]] double final_distance_at(const Pose& model_from_scan) const {
    return score_distance_at(model_from_scan, scan_, model_, options_);
  }

  [[nodiscard]] EvidenceOptions evidence_options(const Pose& model_from_scan, double least_distance_mm = 0.0) const {
    return options_within(model_from_scan, std::max(least_distance_mm, final_distance_at(model_from_scan)));
  }

  // What edges show is read as finely as this part fits, not as deviating parts may.
  [[nodiscard]] EvidenceOptions options_at_edges(const Candidate& candidate) const {
    const double final_distance = final_distance_at(candidate.model_from_scan);
    return options_within(candidate.model_from_scan, std::clamp(kEdgeScatter * candidate.rms_mm,
                                                                kFinestEdge * final_distance, final_distance));
  }

  // Eq. 11 measures to the closest point; across the surface only, with room along it, is ours. Where surfaces are
  // looked at flatly, there is room up to what it is at the scan's median spacing.
  [[nodiscard]] EvidenceOptions options_within(const Pose& model_from_scan, double distance_mm) const {
    constexpr double kRoomInSpacings = 2.5;
    EvidenceOptions options{distance_mm, 0.0};
    if (options_.paper_mode) return options;
    const double spacing_mm = spacing_around(model_from_scan, model_, scan_, options_);
    options.lateral_mm = std::max(kRoomInSpacings * spacing_mm, distance_mm);
    options.most_lateral_mm = std::max(kRoomInSpacings * scan_.spacing_mm, distance_mm);
    return options;
  }

  const scan::Scan& scan_;
  const model::PreparedModel& model_;
  VerifyOptions options_;
  const Context& context_;
  const std::vector<std::uint8_t>& background_;
  const ScanEvidence& evidence_;
  const std::vector<Eigen::Vector3f>& shuffled_foreground_;
  double rim_reach_;
  const std::vector<RimProbe>& rim_probes_;
  bool one_of_several_;
};

Result<void> VerifyOptions::validate() const {
  ASBUILT_CHECK(expect_between("score_distance", score_distance_mm, 0.0, 1e6));
  ASBUILT_CHECK(expect_between("deviation_ratio", deviation_ratio, 0.0, 0.1));
  ASBUILT_CHECK(expect_between("acceptance_score", acceptance_score, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("min_normal_agreement", min_normal_agreement, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("min_explained_samples", min_explained_samples, 0, 1000000));
  ASBUILT_CHECK(expect_between("min_margin", min_margin, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("min_contrast", min_contrast, 0.0, 1e6));
  ASBUILT_CHECK(expect_between("min_contrast_share", min_contrast_share, 0.5, 1.0));
  ASBUILT_CHECK(expect_between("max_free_space_share", max_free_space_share, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("max_residual_ratio", max_residual_ratio, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("max_contradiction_share", max_contradiction_share, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("min_proof", min_proof, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("hidden_surcharge", hidden_surcharge, 0.0, 10.0));
  ASBUILT_CHECK(expect_between("missing_surcharge", missing_surcharge, 0.0, 10.0));
  ASBUILT_CHECK(expect_between("edges_surcharge", edges_surcharge, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("no_rays_surcharge", no_rays_surcharge, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("min_weakest_direction", min_weakest_direction, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("missing_hold_surcharge", missing_hold_surcharge, 0.0, 100.0));
  ASBUILT_CHECK(expect_between("near_equal_ratio", near_equal_ratio, 0.0, 0.1));
  ASBUILT_CHECK(expect_between("max_overrun_share", max_overrun_share, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("max_joint_denial", max_joint_denial, 0.0, 2.0));
  ASBUILT_CHECK(expect_between("max_lost_end_share", max_lost_end_share, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("max_pierced_share", max_pierced_share, 0.0, 1.0));
  ASBUILT_CHECK(expect_between("max_normal_angle_deg", max_normal_angle_deg, 1.0, 180.0));
  return {};
}

Result<Detection> Judge::Verification::verdict_on(std::vector<Candidate> candidates, Look look,
                                                  bool accept_anyway) const {
  candidates = coarse_to_fine(std::move(candidates), look);
  constexpr int kRounds = 2;  // the second for what the first brought to the front
  for (int round = 0; round < kRounds && add_near_poses(candidates); ++round) {
  }
  candidates = contenders(std::move(candidates));
  parallel_for(context_, candidates.size(), 1, [&](std::size_t i) {
    if (!context_.cancelled()) register_densely(candidates[i]);
  });
  if (context_.cancelled()) return fail(ErrorCode::cancelled, "stopped while verifying");

  const auto compare = [&](const Candidate& first, const Candidate& second) { return contrast_of(first, second); };
  const auto compare_edges = [&](const Candidate& first, const Candidate& second) {
    return contrast(first.model_from_scan, second.model_from_scan, model_, evidence_, options_at_edges(first));
  };
  const auto decided = [&] {
    return decide(without_beaten_at_edges(candidates, model_, options_, compare_edges), model_, options_, compare,
                  one_of_several_);
  };
  Detection detection = decided();
  const bool may_be_another = detection.status == Status::accepted || detection.reason == Reason::under_constrained;
  if (may_be_another && add_attitudes_of(detection.best, candidates)) {
    if (context_.cancelled()) return fail(ErrorCode::cancelled, "stopped while verifying");
    detection = decided();
  }
  if (accept_anyway && !detection.candidates.empty() && detection.status != Status::accepted) {
    detection.explanation = fmt::format("accepted because the user vouches for it, although {}", detection.explanation);
    detection.status = Status::accepted;
    detection.reason = Reason::none;
  }
  if (detection.status != Status::rejected) cut_out(detection);
  return detection;
}

Judge::Judge(const scan::Scan& scan, const model::PreparedModel& model, const VerifyOptions& options,
             const Context& context, std::span<const std::uint8_t> taken, const detect::SampledScan* sampled) {
  ASBUILT_EXPECT(options.validate().has_value(), "valid options");
  ASBUILT_EXPECT(taken.empty() || taken.size() == scan.cloud.size(), "one byte a point of the scan");
  material_ = std::make_unique<const Material>(scan, model, options, context, taken, sampled);
}
Judge::~Judge() = default;
Judge::Judge(Judge&&) noexcept = default;
Judge& Judge::operator=(Judge&&) noexcept = default;

Result<Detection> Judge::verdict_on(std::span<const detect::Hypothesis> hypotheses, Look look,
                                    bool accept_anyway) const {
  std::vector<Candidate> candidates;
  for (const detect::Hypothesis& hypothesis : hypotheses) {
    Candidate candidate;
    candidate.model_from_scan = hypothesis.model_from_scan;
    candidate.votes = hypothesis.votes;
    candidates.push_back(candidate);
  }
  return Verification(*material_, look).verdict_on(std::move(candidates), look, accept_anyway);
}

Segment part_at(const Pose& model_from_scan, const scan::Scan& scan, const model::PreparedModel& model,
                const VerifyOptions& options, const detect::SampledScan& sampled, const Context& context) {
  return segment_at(model_from_scan, scan, model, background_of(scan, model, options, context, &sampled),
                    score_distance_at(model_from_scan, scan, model, options), context);
}

Result<Detection> verify(const scan::Scan& scan, const model::PreparedModel& model,
                         std::span<const detect::Hypothesis> hypotheses, const VerifyOptions& options,
                         const Context& context, bool accept_anyway, std::span<const std::uint8_t> taken,
                         const detect::SampledScan* sampled) {
  ASBUILT_CHECK(options.validate());
  return Judge(scan, model, options, context, taken, sampled).verdict_on(hypotheses, Look::thorough, accept_anyway);
}

}  // namespace asbuilt::verify
