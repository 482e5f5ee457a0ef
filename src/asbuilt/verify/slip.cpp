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

// Of the part's surface, to first order, for a unit twist about the centre of its box.
double largest_motion_mm(const Vector6d& twist, const model::PreparedModel& model) {
  const Eigen::Vector3d centre = model.box.center(), turn = twist.head<3>(), shift = twist.tail<3>();
  double largest = 0.0;
  for (const Eigen::Vector3f& sample : model.samples.positions) {
    largest = std::max(largest, (turn.cross(sample.cast<double>() - centre) + shift).squaredNorm());
  }
  return std::sqrt(largest);
}

// Both ways along those of the loosest directions that hold less than `below` of information.
std::vector<Pose> slips(const Pose& model_from_scan, const PoseEvidence& evidence, const model::PreparedModel& model,
                        double slip_mm, double below) {
  // A turn that the part's symmetry makes invisible is no slip.
  Matrix6d information = evidence.information;
  for (const Vector6d& twist : free_twists(model)) {
    information += 1e3 * evidence.information.trace() * twist * twist.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(information);
  const Eigen::Vector3d centre = model.box.center();
  std::vector<Pose> slipped;
  for (int k = 0; k < kLoosest && solver.eigenvalues()[k] < below; ++k) {
    Vector6d twist = solver.eigenvectors().col(k);
    twist.head<3>() /= 0.5 * model.diameter;  // the evidence measures rotations by the motion at half a diameter
    const double unit = largest_motion_mm(twist, model);
    if (!(unit > 0.0)) continue;
    for (const double sign : {-1.0, 1.0}) {
      slipped.push_back(stepped(model_from_scan, sign * slip_mm / unit * twist, centre));
    }
  }
  return slipped;
}

}  // namespace

std::vector<Pose> slipped_poses(const Pose& model_from_scan, const PoseEvidence& evidence,
                                const model::PreparedModel& model, double min_held, double slip_mm) {
  return slips(model_from_scan, evidence, model, slip_mm, min_held * static_cast<double>(evidence.explained_samples));
}

Pose settled_between_edges(const Pose& model_from_scan, const PoseEvidence& evidence, const model::PreparedModel& model,
                           double min_held, const ScanEvidence& scan, const EvidenceOptions& options) {
  constexpr double kSteps[] = {0.03, 0.015, 0.0075};  // of the diameter
  constexpr int kMostMoves = 4;                       // of each
  constexpr double kLeastGain = 2.0;                  // measurements
  Pose settled = model_from_scan;
  for (const double step : kSteps) {
    for (int move = 0; move < kMostMoves; ++move) {
      const Pose here = settled;
      double most = kLeastGain;
      for (const Pose& slipped : slipped_poses(here, evidence, model, min_held, step * model.diameter)) {
        const PoseContrast seen = contrast(here, slipped, model, scan, options);
        if (seen.for_second - seen.for_first <= most) continue;
        most = seen.for_second - seen.for_first;
        settled = slipped;
      }
      if (settled.isApprox(here)) break;
    }
  }
  return settled;
}

double least_lead_over_slips(const Pose& model_from_scan, const PoseEvidence& evidence,
                             const model::PreparedModel& model, double min_held, double slip_mm,
                             const ScanEvidence& scan, const EvidenceOptions& options) {
  double least = std::numeric_limits<double>::infinity();
  for (const Pose& slipped : slipped_poses(model_from_scan, evidence, model, min_held, slip_mm)) {
    const PoseContrast seen = contrast(model_from_scan, slipped, model, scan, options);
    least = std::min(least, seen.for_first - seen.for_second);
  }
  return std::isfinite(least) ? least : 0.0;
}

}  // namespace asbuilt::verify
