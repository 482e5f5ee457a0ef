// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/instances.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/core/parallel.h"
#include "asbuilt/verify/verdict.h"

namespace asbuilt::verify {
namespace {

constexpr std::size_t kMostInstances = 20;

/// A placement with what its own verdict leaves to be settled by the others.
struct Placement {
  Detection detection;
  std::vector<Candidate> rivals_elsewhere;  ///< that may be placements of their own
};

std::vector<Candidate> rivals_elsewhere(const Detection& detection, const model::PreparedModel& model,
                                        const VerifyOptions& options) {
  std::vector<Candidate> rivals;
  for (const Candidate& candidate : detection.candidates) {
    if (is_second_instance(detection.best, candidate, model, options)) rivals.push_back(candidate);
  }
  return rivals;
}

// A rival elsewhere that became no placement has no points of its own: it explains those of this one.
void settle_rivals(std::vector<Placement>& placements, const model::PreparedModel& model) {
  for (std::size_t i = 0; i < placements.size(); ++i) {
    Detection& detection = placements[i].detection;
    if (detection.status != Status::accepted) continue;
    for (const Candidate& rival : placements[i].rivals_elsewhere) {
      const bool found = std::ranges::any_of(placements, [&](const Placement& other) {
        return &other != &placements[i] && is_in_one_place(other.detection.best, rival, model);
      });
      if (found) continue;
      detection.status = Status::ambiguous;
      detection.reason = Reason::second_instance;
      detection.explanation = second_instance_sentence(detection.best, rival, model) +
                              ", but the two explain the same points, so that one of them is wrong";
      break;
    }
  }
}

double distance_mm(const scan::Scan& scan, std::uint32_t point, const Detection& placement,
                   const model::PreparedModel& model) {
  const Eigen::Vector3d in_model = placement.best.model_from_scan * scan.cloud.positions[point].cast<double>();
  return std::abs(model.surface->nearest(in_model).signed_distance);
}

}  // namespace

Result<std::vector<Detection>> verify_instances(const scan::Scan& scan, const model::PreparedModel& model,
                                                std::span<const detect::Hypothesis> hypotheses,
                                                const VerifyOptions& options, const Context& context,
                                                const detect::SampledScan* sampled) {
  std::vector<Placement> placements;
  std::vector<std::uint8_t> taken(scan.cloud.size(), 0);
  while (placements.size() < kMostInstances) {
    ASBUILT_TRY(detection, verify(scan, model, hypotheses, options, context, false, taken, sampled));
    const bool rejected = detection.status == Status::rejected;
    const bool is_further = !placements.empty();
    if (is_further && (rejected || !is_comparable(detection.best, placements.front().detection.best))) break;
    for (const std::uint32_t i : detection.segment) taken[i] = 1;
    std::vector<Candidate> rivals = rivals_elsewhere(detection, model, options);
    placements.push_back({std::move(detection), std::move(rivals)});
    if (rejected || options.paper_mode) break;
  }
  settle_rivals(placements, model);
  std::vector<Detection> detections;
  for (Placement& placement : placements) detections.push_back(std::move(placement.detection));
  separate_segments(detections, scan, model, context);
  return detections;
}

void separate_segments(std::span<Detection> placements, const scan::Scan& scan, const model::PreparedModel& model,
                       const Context& context) {
  if (placements.size() < 2) return;
  std::vector<std::uint8_t> claims(scan.cloud.size(), 0);
  for (const Detection& placement : placements) {
    for (const std::uint32_t i : placement.segment) ++claims[i];
  }
  // The owner of a point that several claim.
  std::vector<std::uint8_t> owner(scan.cloud.size(), 0);
  parallel_for(context, scan.cloud.size(), 1024, [&](std::size_t i) {
    if (claims[i] < 2) return;
    const auto point = static_cast<std::uint32_t>(i);
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t p = 0; p < placements.size(); ++p) {
      if (!std::ranges::binary_search(placements[p].segment, point)) continue;
      const double distance = distance_mm(scan, point, placements[p], model);
      if (distance >= nearest) continue;
      nearest = distance;
      owner[i] = static_cast<std::uint8_t>(p);
    }
  });
  for (std::size_t p = 0; p < placements.size(); ++p) {
    std::vector<std::uint32_t> kept;
    std::vector<std::uint32_t>& margin = placements[p].margin_points;
    for (const std::uint32_t i : placements[p].segment) (claims[i] < 2 || owner[i] == p ? kept : margin).push_back(i);
    placements[p].segment = std::move(kept);
    std::ranges::sort(margin);
  }
}

}  // namespace asbuilt::verify
