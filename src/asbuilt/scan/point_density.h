// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"

namespace asbuilt::scan {

/// How densely a scan's surfaces are measured, and the place that explains it. Seen from c, a surface with the normal n
/// around p has |n . v| / w points per area times a rate k, v = c - p, where
///
///     w = |v|^3            if the sensor measures in even steps of angle (k a steradian),
///     w = (a . v)^3        in even steps of the tangent about the axis a through the middle, as cameras do,
///     w = |v|^2 |e x v|    in even steps of azimuth and height about e, as scanners on a tripod do; e is y or z of the
///                          scan's frame, since exports seldom give up the vertical.
///
/// Signs of normals do not matter. Lengths in mm.
class PointDensity {
 public:
  enum class Steps { angles, tangents, turns_about_y, turns_about_z };

  /// A viewpoint fitted to the densities, and what it leaves.
  struct Fit {
    Eigen::Vector3d position_in_scan = Eigen::Vector3d::Zero();
    Steps steps = Steps::angles;
    double log_rate = 0.0;  ///< ln k, points per steradian
    double misfit = 0.0;    ///< root of the mean robust loss of ln(measured / predicted density)
  };

  /// Measures at up to `most` places drawn from the points, away from edges. `normals` and `surface_variation` are of
  /// plane fits; `tree` is of `points`. The draw depends on the number of points alone.
  PointDensity(std::span<const Eigen::Vector3f> points, std::span<const Eigen::Vector3f> normals,
               std::span<const float> surface_variation, const KdTree& tree, double noise_sigma_mm, std::size_t most,
               const Context& context);

  /// Whether there were enough places to say anything.
  [[nodiscard]] bool known() const;

  /// Fit::misfit for a sensor at that place, of the better steps and their best rate. Scans have at most 0.2 where they
  /// were taken (docs/scan.md, section 4). Precondition: known().
  [[nodiscard]] double misfit(const Eigen::Vector3d& position_in_scan) const;

  /// The same for a density that is the same everywhere, as in a cloud that was thinned evenly. Precondition: known().
  [[nodiscard]] double misfit_of_even() const;

  /// Fits from all around the scan and from its midst, best first, one from each basin, at most three. Empty if not
  /// known().
  [[nodiscard]] std::vector<Fit> fits(const Context& context) const;

 private:
  struct Place {
    Eigen::Vector3d point, normal;
    double log_density;  // of points per mm^2
  };
  class View;
  [[nodiscard]] bool may_have(Steps steps, const Eigen::Vector3d& position_in_scan) const;
  [[nodiscard]] Fit fitted(std::span<const Place> places, Steps steps, const Eigen::Vector3d& start,
                           int most_steps) const;

  std::vector<Place> places_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();  // of the places
  double radius_mm_ = 0.0, size_mm_ = 0.0;            // of the places about their middle: largest, median
};

}  // namespace asbuilt::scan
