// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/slip.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "asbuilt/core/matrix_factors.h"
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

using Twists = Eigen::Matrix<double, 6, Eigen::Dynamic>;

// Any basis spans the motions that a plane leaves free, but only pure shifts along the part's edges and a pure turn lead
// to where other edges are met. So the turns come first, then shifts along the axes of the part's box.
Twists turns_and_shifts(const Twists& basis) {
  constexpr double kPureShift = 0.05;  // share of the turn in a unit twist
  const Eigen::Index count = basis.cols();
  const Eigen::Matrix3Xd turns = basis.topRows<3>();
  const RightSingularVectors singular = right_singular_vectors(turns);
  Twists sorted = basis * singular.vectors;
  Eigen::Index first_shift = 0;
  while (first_shift < std::min<Eigen::Index>(count, 3) && singular.values[first_shift] > kPureShift) ++first_shift;
  const Eigen::Index shifts = count - first_shift;
  if (shifts < 2) return sorted;
  const Eigen::Matrix3Xd along = sorted.bottomRightCorner(3, shifts);
  // The box's axes as the shifts can follow them, the best followed first.
  const Eigen::MatrixXd followed = along.transpose();
  std::array<Eigen::Index, 3> axes = {0, 1, 2};
  std::ranges::stable_sort(axes, [&](Eigen::Index a, Eigen::Index b) {
    return followed.col(a).norm() > followed.col(b).norm() + 1e-9;
  });
  Eigen::MatrixXd wanted(shifts, shifts);
  for (Eigen::Index i = 0; i < shifts; ++i) wanted.col(i) = followed.col(axes[static_cast<std::size_t>(i)]);
  const Eigen::MatrixXd turned = orthogonal_basis(wanted);
  sorted.rightCols(shifts) = (sorted.rightCols(shifts) * turned).eval();
  return sorted;
}

// The loosest directions, those that hold less than `below` of information, as twists.
std::vector<Vector6d> loosest(const PoseEvidence& evidence, const model::PreparedModel& model, double below) {
  // A turn that the part's symmetry makes invisible is no slip.
  Matrix6d information = evidence.information;
  for (const Vector6d& twist : free_twists(model)) {
    information += 1e3 * evidence.information.trace() * twist * twist.transpose();
  }
  const SymmetricEigen<6> solver(information);
  Eigen::Index count = 0;
  while (count < kLoosest && solver.eigenvalues()[count] < below) ++count;
  if (count == 0) return {};
  const Twists basis = turns_and_shifts(solver.eigenvectors().leftCols(count));
  std::vector<Vector6d> twists;
  for (Eigen::Index k = 0; k < count; ++k) {
    Vector6d twist = basis.col(k);
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
  constexpr double kFine = 0.01;                             // below, valleys across the directions matter
  constexpr double kCoarse = 0.02;                           // above, few samples show where to go
  constexpr int kMostMoves = 4;                              // of each
  constexpr double kLeastGain = 2.0;                         // measurements
  constexpr std::size_t kFewSamples = 2000;
  Pose settled = model_from_scan;
  constexpr std::size_t kAllSamples = std::numeric_limits<std::size_t>::max();
  for (const double step : kSteps) {
    const bool is_coarse = step > kCoarse;
    const Slips kinds = step > kFine ? Slips::single : Slips::combined;
    for (int move = 0; move < kMostMoves; ++move) {
      const Pose here = settled;
      ContrastOf contrast(here, model, scan, options);
      const auto gain = [&](const Pose& to, std::size_t most_samples) {
        const PoseContrast seen = contrast.against(to, most_samples);
        return seen.for_second - seen.for_first;
      };
      double most = kLeastGain;
      for (const Pose& slipped : slipped_poses(here, evidence, model, min_held, step * model.diameter, kinds)) {
        const double gained = gain(slipped, is_coarse ? kFewSamples : kAllSamples);
        if (gained <= most) continue;
        most = gained;
        settled = slipped;
      }
      if (settled.isApprox(here)) break;
      // A handful of few samples at an edge is chance.
      if (is_coarse && gain(settled, kAllSamples) <= kLeastGain) {
        settled = here;
        break;
      }
    }
  }
  return settled;
}

Slip strongest_slip(const Pose& model_from_scan, const PoseEvidence& evidence, const model::PreparedModel& model,
                    double min_held, double slip_mm, ContrastOf& contrast) {
  Slip strongest;
  for (const Pose& slipped : slipped_poses(model_from_scan, evidence, model, min_held, slip_mm, Slips::combined)) {
    const PoseContrast seen = contrast.against(slipped);
    const double lead = seen.for_first - seen.for_second;
    if (lead < strongest.lead_over_it) strongest = {slipped, lead};
  }
  return strongest;
}

}  // namespace asbuilt::verify
