// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/slip.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

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

double slip_loss(const Pose& model_from_scan, const model::PreparedModel& model, double slip_mm,
                 const ScanEvidence& scan, double contradiction_weight, const EvidenceOptions& options) {
  const PoseEvidence here = evidence_for(model_from_scan, model.dense_samples, model, scan, options);
  const double support = here.support(contradiction_weight);
  if (!(support > 0.0)) return 0.0;
  double least = 1.0;
  for (const Pose& pose : slipped_poses(model_from_scan, here, model, slip_mm)) {
    const PoseEvidence there = evidence_for(pose, model.dense_samples, model, scan, options);
    least = std::min(least, 1.0 - there.support(contradiction_weight) / support);
  }
  return least;
}

}  // namespace asbuilt::verify
