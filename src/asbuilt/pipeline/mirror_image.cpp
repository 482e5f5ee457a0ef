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

// A pose in the scan for one in the mirrored scan, or the other way round: the part mirrored at a plane through the
// middle of its box, which stays where it is.
Pose in_mirror(const Pose& model_from_scan, const model::PreparedModel& model, Eigen::Index axis) {
  const Reflection mirrored = reflection(axis, model.box.center()[axis]) * model_from_scan * reflection(0, 0.0);
  Pose result = Pose::Identity();
  result.linear() = mirrored.linear();
  result.translation() = mirrored.translation();
  return result;
}

bool is_doubtful(const verify::Detection& placement, const Options& options) {
  return placement.status == verify::Status::accepted && !verify::is_beyond_doubt(placement, options.verify);
}

}  // namespace

bool may_be_mirror_images(const std::vector<verify::Detection>& placements, const Options& options) {
  return !options.paper_mode &&
         std::ranges::any_of(placements, [&](const auto& placement) { return is_doubtful(placement, options); });
}

Result<void> reject_mirror_images(std::vector<verify::Detection>& placements, const scan::Scan& scan,
                                  const model::PreparedModel& model, const detect::Codebook& codebook,
                                  const Options& options, const Context& context) {
  if (!may_be_mirror_images(placements, options)) return {};

  const scan::Scan mirrored = scan::mirrored(scan);
  const auto sampled = detect::sampled_scan(mirrored, model.sampling_distance, model.diameter, context);
  detect::HypothesisSearch search(mirrored, sampled, codebook, options.detect);
  ASBUILT_CHECK(search.vote(std::max(options.detect.first_reference_points, 1), context));
  std::vector<detect::Hypothesis> hypotheses = search.hypotheses(options.detect.first_hypotheses, context);
  for (const verify::Detection& placement : placements) {
    for (Eigen::Index axis = 0; axis < 3 && is_doubtful(placement, options); ++axis) {
      hypotheses.push_back({in_mirror(placement.best.model_from_scan, model, axis), placement.best.votes});
    }
  }
  const verify::Judge judge(mirrored, model, options.verify, context, {}, &sampled);
  ASBUILT_TRY(rivals, judge.verdict_on(hypotheses, verify::Look::quick));

  for (verify::Detection& placement : placements) {
    if (!is_doubtful(placement, options)) continue;
    const auto better = std::ranges::find_if(rivals.candidates, [&](const verify::Candidate& c) {
      verify::Candidate there = c;
      there.model_from_scan = in_mirror(c.model_from_scan, model, 0);
      return c.objection == verify::Reason::none && c.support > kClearlyMore * placement.best.support &&
             verify::is_in_one_place(there, placement.best, model);
    });
    if (better == rivals.candidates.end()) continue;
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
