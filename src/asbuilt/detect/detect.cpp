// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/detect.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"

namespace asbuilt::detect {
namespace {

// A random draw without repetition: a stride over the order of the points would follow the scanner's lines.
std::vector<std::uint32_t> drawn_order(std::size_t samples) {
  std::vector<std::uint32_t> order(samples);
  std::iota(order.begin(), order.end(), 0U);
  Random random(0, "reference points", samples);
  for (std::size_t i = 0; i < samples; ++i) std::swap(order[i], order[i + random.below(samples - i)]);
  return order;
}

// One voting answers for all looks.
DetectOptions with_most_peaks(DetectOptions options) {
  options.peaks_per_reference = std::max(options.peaks_per_reference, options.last_peaks_per_reference);
  options.peak_ratio = std::min(options.peak_ratio, options.last_peak_ratio);
  return options;
}

std::vector<Hypothesis> hypotheses_of(const std::vector<Peak>& peaks, const Codebook& codebook,
                                      const Pose& scene_frame) {
  std::vector<Hypothesis> hypotheses;
  for (const Peak& peak : peaks) {
    hypotheses.push_back({model_from_scan_of(codebook.frames[peak.model_sample], scene_frame, peak.alpha), peak.votes});
  }
  return hypotheses;
}

}  // namespace

Scene detection_scene(const scan::Scan& scan, const Codebook& codebook, const DetectOptions& options,
                      const Context& context) {
  return detection_scene(scan, sampled_scan(scan, codebook.sampling_distance, codebook.diameter, context), options);
}

Scene detection_scene(const scan::Scan& scan, const SampledScan& sampled, const DetectOptions& options) {
  Scene scene{{}, scan.viewpoint, scan.normals_oriented};
  for (std::size_t i = 0; i < sampled.samples.size(); ++i) {
    if (options.leave_out_planes && sampled.on_large_plane[i] != 0) continue;
    scene.samples.positions.push_back(sampled.samples.positions[i]);
    scene.samples.normals.push_back(sampled.samples.normals[i]);
  }
  return scene;
}

Result<std::vector<Hypothesis>> find_hypotheses(const scan::Scan& scan, const Codebook& codebook,
                                                const DetectOptions& options, const Context& context) {
  return find_hypotheses(scan, sampled_scan(scan, codebook.sampling_distance, codebook.diameter, context), codebook,
                         options, context);
}

Result<std::vector<Hypothesis>> find_hypotheses(const scan::Scan& scan, const SampledScan& sampled,
                                                const Codebook& codebook, const DetectOptions& options,
                                                const Context& context) {
  ASBUILT_CHECK(options.validate());
  HypothesisSearch search(scan, sampled, codebook, options);
  ASBUILT_CHECK(search.vote(options.reference_points, context));
  return search.hypotheses(options.max_hypotheses, context);
}

HypothesisSearch::HypothesisSearch(const scan::Scan& scan, const SampledScan& sampled, const Codebook& codebook,
                                   const DetectOptions& options)
    : codebook_(codebook),
      options_(options),
      scene_(detection_scene(scan, sampled, options)),
      order_(drawn_order(scene_.samples.size())) {}

Result<void> HypothesisSearch::vote(int wanted, const Context& context, double most_votes) {
  constexpr std::size_t kStep = 500;  // from the scan alone, whatever the number of threads
  const std::size_t last = std::min(static_cast<std::size_t>(wanted), order_.size());
  while (voted_ < last && static_cast<double>(votes_cast_) < most_votes) {
    ASBUILT_CHECK(vote_until(std::min(last, (voted_ / kStep + 1) * kStep), context));
  }
  return {};
}

Result<void> HypothesisSearch::vote_until(std::size_t last, const Context& context) {
  // Without a known sign both sides of the reference are tried.
  const std::size_t signs = scene_.normals_oriented ? 1 : 2;
  std::vector<std::vector<Hypothesis>> found((last - voted_) * signs);
  std::vector<std::uint64_t> cast(found.size());
  parallel_for_blocks(context, found.size(), 16, [&](std::size_t begin, std::size_t end) {
    LocalVoting voting(codebook_, scene_, with_most_peaks(options_));
    for (std::size_t i = begin; i < end && !context.cancelled(); ++i) {
      const std::uint32_t reference = order_[voted_ + i / signs];
      const float sign = i % signs == 0 ? 1.0F : -1.0F;
      const Pose frame = local_frame(scene_.samples.positions[reference], sign * scene_.samples.normals[reference]);
      const std::uint64_t before = voting.votes_cast();
      found[i] = hypotheses_of(voting.vote(reference, sign), codebook_, frame);
      cast[i] = voting.votes_cast() - before;
    }
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "stopped while detecting");
  for (const std::vector<Hypothesis>& some : found) {
    for (std::size_t k = 0; k < some.size(); ++k) {
      found_.push_back(some[k]);
      is_best_.push_back(k < static_cast<std::size_t>(options_.peaks_per_reference) &&
                         some[k].votes >= options_.peak_ratio * some.front().votes);
    }
  }
  votes_cast_ = std::accumulate(cast.begin(), cast.end(), votes_cast_);
  voted_ = last;
  return {};
}

std::vector<Hypothesis> HypothesisSearch::hypotheses(int most, const Context& context, Maxima maxima) const {
  const ClusterOptions cluster{options_.cluster_angle_deg * std::numbers::pi / 180.0,
                               options_.cluster_distance_ratio * codebook_.diameter, most};
  if (maxima == Maxima::many) return cluster_poses(found_, codebook_.centre, cluster, context);
  std::vector<Hypothesis> best;
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (is_best_[i] != 0) best.push_back(found_[i]);
  }
  return cluster_poses(best, codebook_.centre, cluster, context);
}

}  // namespace asbuilt::detect
