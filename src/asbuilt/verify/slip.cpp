// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/slip.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

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

// The loosest directions, those that hold less than `below` of information, as twists.
std::vector<Vector6d> loosest(const PoseEvidence& evidence, const model::PreparedModel& model, double below) {
  // A turn that the part's symmetry makes invisible is no slip.
  Matrix6d information = evidence.information;
  for (const Vector6d& twist : free_twists(model)) {
    information += 1e3 * evidence.information.trace() * twist * twist.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(information);
  std::vector<Vector6d> twists;
  for (int k = 0; k < kLoosest && solver.eigenvalues()[k] < below; ++k) {
    Vector6d twist = solver.eigenvectors().col(k);
    twist.head<3>() /= 0.5 * model.diameter;  // the evidence measures rotations by the motion at half a diameter
    twists.push_back(twist);
  }
  return twists;
}

}  // namespace

int loose_directions(const PoseEvidence& evidence, const model::PreparedModel& model, double min_held) {
  return static_cast<int>(loosest(evidence, model, min_held * static_cast<double>(evidence.explained_samples)).size());
}

std::vector<Pose> slipped_poses(const Pose& model_from_scan, const PoseEvidence& evidence,
                                const model::PreparedModel& model, double min_held, double slip_mm, Slips kinds) {
  const std::vector<Vector6d> twists =
      loosest(evidence, model, min_held * static_cast<double>(evidence.explained_samples));
  const Eigen::Vector3d centre = model.box.center();
  int combinations = 1;
  for (std::size_t k = 0; k < twists.size(); ++k) combinations *= 3;
  std::vector<Pose> slipped;
  for (int combination = 0; combination < combinations; ++combination) {
    Vector6d twist = Vector6d::Zero();
    int digits = combination, mixed = 0;
    for (const Vector6d& direction : twists) {
      twist += static_cast<double>(digits % 3 - 1) * direction;
      mixed += digits % 3 != 1 ? 1 : 0;
      digits /= 3;
    }
    if (kinds == Slips::single && mixed > 1) continue;
    const double unit = largest_motion_mm(twist, model);
    if (!(unit > 0.0)) continue;
    slipped.push_back(stepped(model_from_scan, slip_mm / unit * twist, centre));
  }
  return slipped;
}

Pose settled_between_edges(const Pose& model_from_scan, const PoseEvidence& evidence, const model::PreparedModel& model,
                           double min_held, const ScanEvidence& scan, const EvidenceOptions& options) {
  constexpr double kSteps[] = {0.03, 0.015, 0.0075, 0.004};  // of the diameter
  constexpr double kFine = 0.01;                             // where valleys across the directions matter
  constexpr int kMostMoves = 4;                              // of each
  constexpr double kLeastGain = 2.0;                         // measurements
  constexpr std::size_t kFewSamples = 2000;                  // show where to go
  Pose settled = model_from_scan;
  EvidenceOptions few = options;
  few.most_samples = std::min(few.most_samples, kFewSamples);
  for (const double step : kSteps) {
    for (int move = 0; move < kMostMoves; ++move) {
      const Pose here = settled;
      double most = kLeastGain;
      const Slips kinds = step > kFine ? Slips::single : Slips::combined;
      for (const Pose& slipped : slipped_poses(here, evidence, model, min_held, step * model.diameter, kinds)) {
        const PoseContrast seen = contrast(here, slipped, model, scan, step > kFine ? few : options);
        if (seen.for_second - seen.for_first <= most) continue;
        most = seen.for_second - seen.for_first;
        settled = slipped;
      }
      if (settled.isApprox(here)) break;
    }
  }
  return settled;
}

Slip strongest_slip(const Pose& model_from_scan, const PoseEvidence& evidence, const model::PreparedModel& model,
                    double min_held, double slip_mm, const ScanEvidence& scan, const EvidenceOptions& options) {
  Slip strongest;
  for (const Pose& slipped : slipped_poses(model_from_scan, evidence, model, min_held, slip_mm, Slips::combined)) {
    const PoseContrast seen = contrast(model_from_scan, slipped, model, scan, options);
    const double lead = seen.for_first - seen.for_second;
    if (lead < strongest.lead_over_it) strongest = {slipped, lead};
  }
  return strongest;
}

}  // namespace asbuilt::verify
