// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/size.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include "asbuilt/verify/contrast.h"

namespace asbuilt::verify {
namespace {

// Edges feigned by other things may lead over a copy a tenth off, but not over one of the size that is there: of a
// cylinder's side, what a third of the radius changes is within as-built deviations.
constexpr double kSizes[] = {0.7, 0.8, 0.9, 1.1, 1.25, 1.4};

// Directions in which nothing holds the part are left as they are.
double ridge(const PoseEvidence& evidence) {
  constexpr double kHeldByNothing = 1e-3;
  return kHeldByNothing * std::max(1.0, static_cast<double>(evidence.explained_samples));
}

// The point of the model about which it can grow and stay on the surface that was found.
Eigen::Vector3d fixed_point(const PoseEvidence& evidence, const model::PreparedModel& model) {
  Eigen::Matrix3d information = evidence.information.bottomRightCorner<3, 3>();
  information.diagonal().array() += ridge(evidence);
  const Eigen::Vector3d shift = information.ldlt().solve(evidence.twist_growth.tail<3>());
  return model.box.center() + 0.5 * model.diameter * shift;
}

}  // namespace

double size_hold(const PoseEvidence& evidence) {
  if (evidence.explained_samples == 0) return 0.0;
  Matrix6d information = evidence.information;
  information.diagonal().array() += ridge(evidence);
  const Vector6d twist = information.ldlt().solve(evidence.twist_growth);
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
  return lead;
}

}  // namespace asbuilt::verify
