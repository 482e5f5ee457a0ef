// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/size.h"

#include <algorithm>
#include <limits>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/verify/contrast.h"

namespace asbuilt::verify {
namespace {

// Edges feigned by other things may lead over a copy a tenth off, but not over one of the size that is there: of a
// cylinder's side, what a third of the radius changes is within as-built deviations.
constexpr double kSizes[] = {0.7, 0.8, 0.9, 1.1, 1.25, 1.4};

// A face of something else may be as wide as the part's but for a few percent, and its corner lie at the part's: then
// a copy a little smaller or larger that keeps that corner explains the scan nearly as well. So little shows only with
// less room along the surface, 1.5 spacings, and chance feigns it more easily, so it counts for less.
constexpr double kNearSizes[] = {0.94, 1.06};
constexpr double kNearRoom = 0.6, kNearWeight = 0.5;
constexpr int kCorners = 8;

// Directions in which nothing holds the part are left as they are.
double ridge(const PoseEvidence& evidence) {
  constexpr double kHeldByNothing = 1e-3;
  return kHeldByNothing * std::max(1.0, static_cast<double>(evidence.explained_samples));
}

// The point of the model about which it can grow and stay on the surface that was found.
Eigen::Vector3d fixed_point(const PoseEvidence& evidence, const model::PreparedModel& model) {
  Eigen::Matrix3d information = evidence.information.bottomRightCorner<3, 3>();
  information.diagonal().array() += ridge(evidence);
  const Eigen::Vector3d shift = solve_symmetric(information, evidence.twist_growth.tail<3>());
  return model.box.center() + 0.5 * model.diameter * shift;
}

}  // namespace

double size_hold(const PoseEvidence& evidence) {
  if (evidence.explained_samples == 0) return 0.0;
  Matrix6d information = evidence.information;
  information.diagonal().array() += ridge(evidence);
  const Vector6d twist = solve_symmetric(information, evidence.twist_growth);
  const double left =
      evidence.growth - 2.0 * evidence.twist_growth.dot(twist) + twist.dot(evidence.information * twist);
  return std::max(0.0, left) / static_cast<double>(evidence.explained_samples);
}

double size_lead(const Pose& model_from_scan, const PoseEvidence& evidence, const model::PreparedModel& model,
                 const ScanEvidence& scan, const EvidenceOptions& options) {
  const Eigen::Vector3d fixed = fixed_point(evidence, model);
  ContrastOf contrast(model_from_scan, model, scan, options);
  double lead = std::numeric_limits<double>::infinity();
  for (const double size : kSizes) {
    const PoseContrast seen = contrast.against(SizedPose(model_from_scan, size, fixed));
    lead = std::min(lead, seen.for_first - seen.for_second);
  }
  EvidenceOptions narrow = options;
  narrow.lateral_mm = std::max(kNearRoom * options.lateral_mm, options.distance_mm);
  narrow.most_lateral_mm = std::max(kNearRoom * options.most_lateral_mm, options.distance_mm);
  ContrastOf near_contrast(model_from_scan, model, scan, narrow);
  for (const double size : kNearSizes) {
    for (int k = 0; k < kCorners; ++k) {
      const Eigen::Vector3d corner = model.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k));
      const PoseContrast seen = near_contrast.against(SizedPose(model_from_scan, size, corner));
      lead = std::min(lead, kNearWeight * (seen.for_first - seen.for_second));
    }
  }
  return lead;
}

}  // namespace asbuilt::verify
