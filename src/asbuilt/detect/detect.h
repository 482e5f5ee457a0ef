// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/detect/codebook.h"
#include "asbuilt/detect/large_planes.h"
#include "asbuilt/detect/options.h"
#include "asbuilt/detect/pose_clusters.h"
#include "asbuilt/detect/voting.h"
#include "asbuilt/scan/scan.h"

namespace asbuilt::detect {

/// The samples of a scan that take part in detection: even at the model's sampling distance (Sec. 4: relative to the
/// model, never to the scene), without planes too large for the part (not in paper mode).
[[nodiscard]] Scene detection_scene(const scan::Scan& scan, const Codebook& codebook, const DetectOptions& options,
                                    const Context& context);
[[nodiscard]] Scene detection_scene(const scan::Scan& scan, const SampledScan& sampled, const DetectOptions& options);

/// Which maxima of the voting spaces are clustered: those that are about the best of their reference point, or also
/// those far below, of which only many reference points in agreement make a strong cluster.
enum class Maxima { best, many };

/// Local voting per scene reference point (Eq. 6-10), then pose clusters; it can be gone on with: the more reference
/// points have voted, the smaller a part it finds. They are a random draw, the first of which are the same however many
/// follow, and results depend on their number alone, not on the steps in which they voted or on threads.
class HypothesisSearch {
 public:
  /// `codebook` has to outlive it; `sampled` was taken with its sampling distance and diameter.
  HypothesisSearch(const scan::Scan& scan, const SampledScan& sampled, const Codebook& codebook,
                   const DetectOptions& options);

  /// Lets further reference points vote, until `wanted` have, or there are no more, or at least `most_votes` have been
  /// cast, which is asked after every 500 points. Errors: cancelled.
  [[nodiscard]] Result<void> vote(int wanted, const Context& context,
                                  double most_votes = std::numeric_limits<double>::infinity());

  /// The at most `most` strongest clusters of what has been voted for, by decreasing votes.
  [[nodiscard]] std::vector<Hypothesis> hypotheses(int most, const Context& context,
                                                   Maxima maxima = Maxima::best) const;

  [[nodiscard]] std::uint64_t votes_cast() const { return votes_cast_; }

  /// So many reference points there are in the scan.
  [[nodiscard]] std::size_t most_reference_points() const { return order_.size(); }

 private:
  [[nodiscard]] Result<void> vote_until(std::size_t last, const Context& context);

  const Codebook& codebook_;
  DetectOptions options_;
  Scene scene_;
  std::vector<std::uint32_t> order_;  // of the reference points
  std::size_t voted_ = 0;
  std::vector<Hypothesis> found_;
  std::vector<std::uint8_t> is_best_;  // of found_, by peaks_per_reference and peak_ratio
  std::uint64_t votes_cast_ = 0;
};

/// Where the part may stand in a scan, with all of the options' reference points at once.
/// Sorted by decreasing votes; empty when nothing was voted for. Same bytes for any number of threads.
/// Errors: invalid_argument for options; cancelled.
[[nodiscard]] Result<std::vector<Hypothesis>> find_hypotheses(const scan::Scan& scan, const Codebook& codebook,
                                                              const DetectOptions& options, const Context& context);

/// The same with samples that are at hand, taken with the codebook's sampling distance and diameter.
[[nodiscard]] Result<std::vector<Hypothesis>> find_hypotheses(const scan::Scan& scan, const SampledScan& sampled,
                                                              const Codebook& codebook, const DetectOptions& options,
                                                              const Context& context);

}  // namespace asbuilt::detect
