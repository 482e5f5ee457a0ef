// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "asbuilt/core/pose.h"

namespace asbuilt::refine {

/// A slide, or a turn about an axis, in the frame of the refined poses.
struct Motion {
  bool is_turn = false;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< of the slide or of the axis, of length one
  Eigen::Vector3d through = Eigen::Vector3d::Zero();     ///< a point of the axis, mm; of a slide: the middle of it all
};

/// How well each direction is held by what two linked views share.
struct LinkHold {
  int first = 0, second = 0;
  /// Information of six principal motions, ascending, about the middle of the overlap and in units of its size (rms
  /// radius), per match: a motion along which every match is displaced fully has 1, three slides together have 1.
  Vector6d held = Vector6d::Zero();
  double threshold = 0.0;    ///< `held` below it is what the noise of normals and curvature feign: not held
  std::vector<Motion> free;  ///< motions that leave what they share where it is: a plane has two slides and a turn
};

/// A motion of one view, against all others, along which it is held badly or not at all.
struct LooseMotion {
  Motion motion;
  double sigma_mm = 0.0;  ///< standard deviation (rms over the view's points); the diameter of all views if not held
  bool unheld = false;    ///< nothing holds it: the view stays where detection put it
};

/// How well each direction of a view is held against the fixed one by all links together.
struct ViewHold {
  Vector6d sigma_mm = Vector6d::Zero();  ///< of six principal motions, descending; zero for the fixed view
  std::vector<LooseMotion> loose;        ///< unheld, or known four times worse than usual and worse than the noise
};

/// Takes a space of small motions apart into as many slides as it holds, and turns about axes. `basis`: orthonormal
/// columns (radius * rotation, translation of `centre`).
[[nodiscard]] std::vector<Motion> slides_and_turns(const Eigen::Matrix<double, 6, Eigen::Dynamic>& basis,
                                                   const Eigen::Vector3d& centre, double radius_mm);

/// From the covariance of a view's (radius * rotation, translation of `centre`), mm^2, and the (orthonormal) space of
/// what nothing holds.
[[nodiscard]] ViewHold view_hold(const Matrix6d& covariance, const Eigen::Matrix<double, 6, Eigen::Dynamic>& unheld,
                                 const Eigen::Vector3d& centre, double radius_mm, double noise_mm, double diameter_mm);

}  // namespace asbuilt::refine
