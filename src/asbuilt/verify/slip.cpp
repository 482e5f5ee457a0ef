// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/slip.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/verify/contrast.h"
#include "asbuilt/verify/lm_icp.h"
#include "asbuilt/verify/near_poses.h"
#include "asbuilt/verify/verdict.h"

namespace asbuilt::verify {
namespace {

constexpr int kLoosest = 3;  // directions that are tried: those of a plane

}  // namespace

std::vector<Pose> slipped_poses(const Pose& model_from_scan, const PoseEvidence& evidence,
                                const model::PreparedModel& model, double slip_mm) {
  // A turn that the part's symmetry makes invisible is no slip.
  Matrix6d information = evidence.information;
  for (const Vector6d& twist : free_twists(model)) {
    information += 1e3 * evidence.information.trace() * twist * twist.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(information);
  const Eigen::Vector3d centre = model.box.center();
  std::vector<Pose> slipped;
  for (int k = 0; k < kLoosest; ++k) {
    Vector6d twist = solver.eigenvectors().col(k);
    twist.head<3>() /= 0.5 * model.diameter;  // the evidence measures rotations by the motion at half a diameter
    const double unit = displacement_mm(stepped(model_from_scan, 1e-3 * twist, centre), model_from_scan, model) / 1e-3;
    if (!(unit > 0.0)) continue;
    for (const double sign : {-1.0, 1.0}) {
      slipped.push_back(stepped(model_from_scan, sign * slip_mm / unit * twist, centre));
    }
  }
  return slipped;
}

double least_lead_over_slips(const Pose& model_from_scan, const PoseEvidence& evidence,
                             const model::PreparedModel& model, double slip_mm, const ScanEvidence& scan,
                             const EvidenceOptions& options) {
  double least = std::numeric_limits<double>::infinity();
  for (const Pose& slipped : slipped_poses(model_from_scan, evidence, model, slip_mm)) {
    const PoseContrast seen = contrast(model_from_scan, slipped, model, scan, options);
    least = std::min(least, seen.for_first - seen.for_second);
  }
  return std::isfinite(least) ? least : 0.0;
}

}  // namespace asbuilt::verify
