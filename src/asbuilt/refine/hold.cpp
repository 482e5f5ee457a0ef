// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/hold.h"

#include <algorithm>
#include <cmath>

#include "asbuilt/core/matrix_factors.h"

namespace asbuilt::refine {
namespace {

using Motions = Eigen::Matrix<double, 6, Eigen::Dynamic>;

constexpr double kIsTurn = 0.15;     // of a unit motion: less rotation than this is a slide
constexpr double kTimesUsual = 4.0;  // standard deviation of a loose motion / that of the usual one

// The sign of a direction means nothing; the same one is always given.
void orient(Eigen::Vector3d& direction) {
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0.0) direction = -direction;
}

// The basis of the same space in which slides stand apart from turns.
Motions slides_apart(const Motions& basis) { return basis * right_singular_vectors(basis.topRows<3>()).vectors; }

Motion motion_of(const Vector6d& column, const Eigen::Vector3d& centre, double radius_mm) {
  const Eigen::Vector3d rotation = column.head<3>() / radius_mm, translation = column.tail<3>();
  Motion motion;
  motion.is_turn = column.head<3>().norm() > kIsTurn;
  motion.direction = (motion.is_turn ? rotation : translation).normalized();
  motion.through =
      motion.is_turn ? Eigen::Vector3d(centre + rotation.cross(translation) / rotation.squaredNorm()) : centre;
  orient(motion.direction);
  return motion;
}

}  // namespace

std::vector<Motion> slides_and_turns(const Motions& basis, const Eigen::Vector3d& centre, double radius_mm) {
  std::vector<Motion> motions;
  if (basis.cols() == 0) return motions;
  const Motions apart = slides_apart(basis);
  for (Eigen::Index i = 0; i < apart.cols(); ++i) motions.push_back(motion_of(apart.col(i), centre, radius_mm));
  std::ranges::stable_sort(motions, {}, &Motion::is_turn);  // slides first
  return motions;
}

ViewHold view_hold(const Matrix6d& covariance, const Motions& unheld, const Eigen::Vector3d& centre, double radius_mm,
                   double noise_mm, double diameter_mm) {
  ViewHold hold;
  // What nothing holds is told apart from what is: its huge variance would leak into the rest by rounding.
  const Matrix6d kept = Matrix6d::Identity() - unheld * unheld.transpose();
  const SymmetricEigen<6> eigen(kept * covariance * kept);
  const Eigen::Index free = unheld.cols();
  // Ascending; the first `free` are the zeros of the projection.
  const Vector6d sigma = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  for (Eigen::Index i = 0; i < 6; ++i)
    hold.sigma_mm[i] = i < free ? diameter_mm : std::min(diameter_mm, sigma[5 - (i - free)]);
  const auto add = [&](const Motions& basis, bool is_unheld) {
    if (basis.cols() == 0) return;
    const Motions apart = slides_apart(basis);
    const auto begin = static_cast<std::ptrdiff_t>(hold.loose.size());
    for (Eigen::Index i = 0; i < apart.cols(); ++i) {
      const double variance = apart.col(i).dot(covariance * apart.col(i));
      hold.loose.push_back({motion_of(apart.col(i), centre, radius_mm),
                            is_unheld ? diameter_mm : std::min(diameter_mm, std::sqrt(std::max(0.0, variance))),
                            is_unheld});
    }
    std::stable_sort(hold.loose.begin() + begin, hold.loose.end(), [](const LooseMotion& a, const LooseMotion& b) {
      return !a.motion.is_turn && b.motion.is_turn;  // slides first
    });
  };
  add(unheld, true);
  if (free == 6) return hold;
  const double usual = sigma[free + (5 - free) / 2];
  Eigen::Index weak = 0;
  while (weak + 1 < 6 - free && sigma[5 - weak] > std::max(kTimesUsual * usual, noise_mm)) ++weak;
  add(eigen.eigenvectors().rightCols(weak), false);
  return hold;
}

}  // namespace asbuilt::refine
