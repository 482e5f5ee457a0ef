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
std::vector<std::uint32_t> reference_points(std::size_t samples, int wanted) {
  std::vector<std::uint32_t> order(samples);
  std::iota(order.begin(), order.end(), 0U);
  const std::size_t count = std::min(samples, static_cast<std::size_t>(wanted));
  Random random(0, "reference points", samples);
  for (std::size_t i = 0; i < count; ++i) std::swap(order[i], order[i + random.below(samples - i)]);
  order.resize(count);
  std::ranges::sort(order);
  return order;
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
    if (!options.paper_mode && sampled.on_large_plane[i] != 0) continue;
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
  const Scene scene = detection_scene(scan, sampled, options);
  const std::vector<std::uint32_t> references = reference_points(scene.samples.size(), options.reference_points);
  // Without a known sign both sides of the reference are tried.
  const std::size_t signs = scene.normals_oriented ? 1 : 2;

  std::vector<std::vector<Hypothesis>> found(references.size() * signs);
  parallel_for_blocks(context, found.size(), 16, [&](std::size_t begin, std::size_t end) {
    LocalVoting voting(codebook, scene, options);
    for (std::size_t i = begin; i < end && !context.cancelled(); ++i) {
      const std::uint32_t reference = references[i / signs];
      const float sign = i % signs == 0 ? 1.0F : -1.0F;
      const Pose frame = local_frame(scene.samples.positions[reference], sign * scene.samples.normals[reference]);
      found[i] = hypotheses_of(voting.vote(reference, sign), codebook, frame);
    }
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "stopped while detecting");

  std::vector<Hypothesis> all;
  for (const std::vector<Hypothesis>& some : found) all.insert(all.end(), some.begin(), some.end());
  const ClusterOptions cluster{options.cluster_angle_deg * std::numbers::pi / 180.0,
                               options.cluster_distance_ratio * codebook.diameter, options.max_hypotheses};
  return cluster_poses(all, codebook.centre, cluster, context);
}

}  // namespace asbuilt::detect
