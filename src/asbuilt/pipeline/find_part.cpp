// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/find_part.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <utility>

#include "asbuilt/pipeline/mirror_image.h"
#include "asbuilt/verify/instances.h"
#include "asbuilt/verify/verdict.h"

namespace asbuilt::pipeline {
namespace {

constexpr double kAnyVotes = std::numeric_limits<double>::infinity();

std::vector<detect::Hypothesis> with_starts(const std::vector<Pose>& starts, std::vector<detect::Hypothesis> proposed) {
  const double votes = proposed.empty() ? 1.0 : proposed.front().votes;
  std::vector<detect::Hypothesis> all;
  for (const Pose& start : starts) all.push_back({start, votes});
  all.insert(all.end(), proposed.begin(), proposed.end());
  return all;
}

// What a look found is not lost on the next.
void add_candidates(const verify::Detection& detection, std::vector<detect::Hypothesis>& hypotheses) {
  for (const verify::Candidate& candidate : detection.candidates) {
    hypotheses.push_back({candidate.model_from_scan, candidate.votes});
  }
}

}  // namespace

Result<FoundPart> find_part(const scan::Scan& scan, const model::PreparedModel& model, const detect::Codebook& codebook,
                            const std::vector<Pose>& starts, const Options& options, const TimedStage& timed,
                            const Context& context) {
  ASBUILT_CHECK(options.detect.validate());
  ASBUILT_CHECK(options.verify.validate());
  FoundPart found;
  detect::SampledScan& sampled = found.sampled;
  std::optional<detect::HypothesisSearch> search;
  timed("detect", [&] {
    sampled = detect::sampled_scan(scan, model.sampling_distance, model.diameter, context);
    search.emplace(scan, sampled, codebook, options.detect);
  });
  const auto propose = [&](int reference_points, double most_votes, int most_hypotheses,
                           detect::Maxima maxima = detect::Maxima::best) {
    Result<void> voted;
    timed("detect", [&] {
      voted = search->vote(reference_points, context, most_votes);
      if (voted) found.hypotheses = with_starts(starts, search->hypotheses(most_hypotheses, context, maxima));
    });
    found.votes_cast = search->votes_cast();
    ++found.looks;
    return voted;
  };
  const auto reject_mirrored = [&] {
    Result<void> asked;
    if (!may_be_mirror_images(found.placements, options)) return asked;
    timed("verify", [&] {
      asked = reject_mirror_images(found.placements, scan, model, codebook, options, context);
    });
    return asked;
  };
  const int first = options.detect.first_reference_points, all = options.detect.reference_points;

  if (options.instances == Instances::all) {
    ASBUILT_CHECK(propose(all, kAnyVotes, options.detect.max_hypotheses));
    Result<std::vector<verify::Detection>> placements;
    timed("verify", [&] {
      placements = verify::verify_instances(scan, model, found.hypotheses, options.verify, context, &sampled);
    });
    if (!placements) return tl::unexpected(placements.error());
    found.placements = std::move(*placements);
    ASBUILT_CHECK(reject_mirrored());
    return found;
  }

  std::optional<verify::Judge> judge;
  Result<verify::Detection> detection;
  const auto judge_all = [&](verify::Look look) {
    timed("verify", [&] {
      if (!judge) judge.emplace(scan, model, options.verify, context, std::span<const std::uint8_t>(), &sampled);
      detection = judge->verdict_on(found.hypotheses, look);
    });
  };
  if (first > 0 && first < all) {
    ASBUILT_CHECK(propose(first, kAnyVotes, options.detect.first_hypotheses));
    judge_all(verify::Look::quick);
    if (!detection) return tl::unexpected(detection.error());
  }
  if (found.looks == 0 || !verify::is_beyond_doubt(*detection, options.verify)) {
    ASBUILT_CHECK(propose(all, kAnyVotes, options.detect.max_hypotheses));
    if (found.looks > 1) add_candidates(*detection, found.hypotheses);
    judge_all(verify::Look::thorough);
    if (!detection) return tl::unexpected(detection.error());
  }
  // In a hall, hardly any of the reference points so far need lie on the part.
  const int last = std::min(options.detect.last_reference_points, static_cast<int>(search->most_reference_points()));
  const double most_votes = 1e6 * options.detect.most_million_votes;
  const bool may_go_on = static_cast<double>(search->votes_cast()) < most_votes;
  if (detection->status == verify::Status::rejected && last > all && may_go_on) {
    ASBUILT_CHECK(propose(last, most_votes, options.detect.last_hypotheses, detect::Maxima::many));
    add_candidates(*detection, found.hypotheses);
    judge_all(verify::Look::patient);
    if (!detection) return tl::unexpected(detection.error());
  }
  found.placements.push_back(std::move(*detection));
  ASBUILT_CHECK(reject_mirrored());
  return found;
}

}  // namespace asbuilt::pipeline
