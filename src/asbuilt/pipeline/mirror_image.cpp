// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/mirror_image.h"

#include <fmt/format.h>

#include <algorithm>

#include "asbuilt/detect/detect.h"
#include "asbuilt/scan/mirrored.h"
#include "asbuilt/verify/verdict.h"
#include "asbuilt/verify/verify.h"

namespace asbuilt::pipeline {
namespace {

// Times the support of the part itself. Of right poses the mirror image had at most 1.03 times as much, of two mirror
// images that were taken for the part the part in the mirror had 1.29 and 1.37 times.
constexpr double kClearlyMore = 1.1;

using Reflection = Eigen::Transform<double, 3, Eigen::Affine>;

Reflection reflection(Eigen::Index axis, double at) {
  Reflection result = Reflection::Identity();
  result.linear()(axis, axis) = -1.0;
  result.translation()[axis] = 2.0 * at;
  return result;
}

Eigen::Vector3d centre_in_scan(const verify::Candidate& candidate, const model::PreparedModel& model) {
  return candidate.model_from_scan.inverse() * model.box.center();
}

// A part of the other hand, where this one is said to be: mirrored at a plane through the middle of its box.
void add_mirror_images(const verify::Candidate& candidate, const model::PreparedModel& model,
                       std::vector<detect::Hypothesis>& hypotheses) {
  const Reflection scan_from_mirrored = reflection(0, 0.0);
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Reflection mirrored =
        reflection(axis, model.box.center()[axis]) * candidate.model_from_scan * scan_from_mirrored;
    Pose model_from_mirrored = Pose::Identity();
    model_from_mirrored.linear() = mirrored.linear();
    model_from_mirrored.translation() = mirrored.translation();
    hypotheses.push_back({model_from_mirrored, candidate.votes});
  }
}

}  // namespace

Result<void> reject_mirror_images(std::vector<verify::Detection>& placements, const scan::Scan& scan,
                                  const model::PreparedModel& model, const detect::Codebook& codebook,
                                  const Options& options, const Context& context) {
  const auto is_doubtful = [&](const verify::Detection& placement) {
    return placement.status == verify::Status::accepted && !verify::is_beyond_doubt(placement, options.verify);
  };
  if (options.paper_mode || std::ranges::none_of(placements, is_doubtful)) return {};

  const scan::Scan mirrored = scan::mirrored(scan);
  const auto sampled = detect::sampled_scan(mirrored, model.sampling_distance, model.diameter, context);
  detect::HypothesisSearch search(mirrored, sampled, codebook, options.detect);
  ASBUILT_CHECK(search.vote(std::max(options.detect.first_reference_points, 1), context));
  std::vector<detect::Hypothesis> hypotheses = search.hypotheses(options.detect.first_hypotheses, context);
  for (const verify::Detection& placement : placements) {
    if (is_doubtful(placement)) add_mirror_images(placement.best, model, hypotheses);
  }
  const verify::Judge judge(mirrored, model, options.verify, context, {}, &sampled);
  ASBUILT_TRY(in_mirror, judge.verdict_on(hypotheses, verify::Look::quick));

  for (verify::Detection& placement : placements) {
    if (!is_doubtful(placement)) continue;
    const Eigen::Vector3d claimed = centre_in_scan(placement.best, model);
    const auto better = std::ranges::find_if(in_mirror.candidates, [&](const verify::Candidate& c) {
      const Eigen::Vector3d there = reflection(0, 0.0) * centre_in_scan(c, model);
      return c.objection == verify::Reason::none && c.support > kClearlyMore * placement.best.support &&
             verify::is_one_place((there - claimed).norm(), model);
    });
    if (better == in_mirror.candidates.end()) continue;
    placement.status = verify::Status::rejected;
    placement.reason = verify::Reason::mirror_image;
    placement.explanation = fmt::format(
        "the part's mirror image would explain the scan better: evidence for it less evidence against it gives it a "
        "support of {:.3f}, beside {:.3f}",
        better->support, placement.best.support);
    placement.segment.clear();
    placement.margin_points.clear();
  }
  return {};
}

}  // namespace asbuilt::pipeline
