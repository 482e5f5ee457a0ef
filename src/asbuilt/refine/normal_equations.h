// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/refine/correspondences.h"

namespace asbuilt::refine {

/// Sums over the matches of one directed edge. As the residual's derivative by the target's pose is the negative of
/// that by the source's, six by six numbers stand for the twelve by twelve block of the edge.
struct EdgeSums {
  Matrix6d information = Matrix6d::Zero();  ///< sum of w J J^T
  Vector6d gradient = Vector6d::Zero();     ///< sum of w J r, by the pose of the source
  double cost = 0.0;                        ///< sum of rho(r^2)
  double weight = 0.0;                      ///< sum of w
  double weighted_squares = 0.0;            ///< sum of w r^2
  Eigen::Vector3d weighted_position = Eigen::Vector3d::Zero();
  double weighted_square_position = 0.0;

  EdgeSums& operator+=(const EdgeSums& other);
};

/// Lengths and origin in which the unknowns are comparable: twist = (L w, t) about `origin`, all in mm.
struct Scaling {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double length_mm = 1.0;

  /// Takes a scaled twist to (rotation rad, translation mm) about the frame's own origin.
  [[nodiscard]] Matrix6d twist_from_scaled() const;
};

/// Linearises every edge at `poses`; sums in an order that does not depend on the threads.
/// With `symmetric` the residual is that of symmetric_point_to_plane.
[[nodiscard]] std::vector<EdgeSums> linearise(std::span<const DirectedEdge> edges, std::span<const SampledView> views,
                                              std::span<const Pose> poses, const Scaling& scaling, bool symmetric,
                                              const Context& context);

/// Only the value of Eq. 5 at `poses`, for the same matches.
[[nodiscard]] double total_cost(std::span<const DirectedEdge> edges, std::span<const SampledView> views,
                                std::span<const Pose> poses, bool symmetric, const Context& context);

/// Both directions of a link, by the pose of `first`.
struct LinkBlock {
  int first = 0, second = 0;
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double weight = 0.0;
};

/// The information of a link in its overlap's own centre and size, per match.
struct LocalInformation {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< from the scaling's origin
  double radius_mm = 0.0;                            ///< 0: no matches, or all in one place; the rest is then zero
  Vector6d held = Vector6d::Zero();                  ///< eigenvalues, ascending
  Matrix6d motions = Matrix6d::Zero();               ///< their vectors (radius * rotation, translation of the centre)
  Matrix6d scaled_from_local = Matrix6d::Identity();
};
[[nodiscard]] LocalInformation local_information(const EdgeSums& both_ways, const Scaling& scaling);

/// Removes from a link what it does not hold: directions whose information, in the overlap's own centre and size, is
/// below `threshold` of what a fully constraining pair gives. Two noisy planes seem to hold the slide along each other
/// through the noise of their normals; so does a cylinder its turn, by the curvature between matched samples. With the
/// mean squared angle between matched normals as threshold, such information is not believed.
[[nodiscard]] LinkBlock held_part(const LinkBlock& link, const EdgeSums& both_ways, const Scaling& scaling,
                                  double threshold);

/// What is left of a link in the directions that `both_ways`, other matches of it, hold with less than `threshold`.
[[nodiscard]] LinkBlock part_not_held_by(const EdgeSums& both_ways, const LinkBlock& link, const Scaling& scaling,
                                         double threshold);

/// What the matches of one link in one cube of space say: their share of the gradient of Eq. 5, by the pose of `first`.
struct CellGradient {
  std::uint32_t cell = 0;  ///< numbers from 0 on; a cube has the same number for all links
  std::uint32_t link = 0;
  Vector6d gradient = Vector6d::Zero();
};

/// The normal equations of all views but the fixed one, six unknowns each.
class NormalEquations {
 public:
  NormalEquations(int views, int fixed_view, std::span<const LinkBlock> links);

  /// The step that minimises the quadratic model plus the damping: `damping` times the mean information as a sphere
  /// (so that what nothing holds stays where it is), or times the diagonal (Marquardt's, paper mode). One scaled twist
  /// a view, zero for the fixed one. Empty if the system cannot be solved.
  [[nodiscard]] std::vector<Vector6d> step(double damping, bool marquardt) const;

  /// Diagonal 6x6 blocks of the inverse, a tiny damping included: directions that nothing holds come out huge, not NaN.
  [[nodiscard]] std::vector<Matrix6d> inverse_blocks() const;

  /// Diagonal 6x6 blocks of H^-1 (sum over cells of g g^T) H^-1: how far the solution would be strewn if each cell's
  /// gradient were drawn anew, independently of the others'. `cells` is ordered by cell; its links are those of the
  /// constructor. Directions that nothing holds come out huge.
  [[nodiscard]] std::vector<Matrix6d> strewn_blocks(std::span<const CellGradient> cells) const;

  /// Entries of inverse_blocks() above this belong to directions that nothing holds.
  [[nodiscard]] double unheld_variance() const;

  [[nodiscard]] double mean_information() const { return mean_information_; }

 private:
  [[nodiscard]] int unknown_of(int view) const;  // first unknown, or -1
  template <class Solver>
  [[nodiscard]] std::vector<Matrix6d> blocks_with(const Solver& solver) const;
  template <class Solver>
  [[nodiscard]] std::vector<Matrix6d> strewn_with(const Solver& solver, std::span<const CellGradient> cells) const;
  template <class Work>
  [[nodiscard]] auto with_solver(const Work& work) const;

  int views_, fixed_view_;
  std::vector<LinkBlock> links_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd diagonal_;
  double mean_information_ = 0.0;
};

}  // namespace asbuilt::refine
