// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "asbuilt/core/context.h"
#include "asbuilt/scan/point_density.h"
#include "asbuilt/scan/shadow_image.h"

namespace asbuilt::scan {

/// Where a sensor must have stood that measured all points from one place, and how well that explains them.
struct FoundViewpoint {
  Eigen::Vector3d position_in_scan = Eigen::Vector3d::Zero();  ///< mm
  double density_misfit = 0.0;                                 ///< PointDensity::Fit::misfit of the fit that led there
  Shadows shadows;                                             ///< as seen from there
  Shadows shadows_of_rival;                                    ///< as seen from the rival, where one was given
};

/// Looks for the viewpoint of a scan that was moved to a frame of its own: the places that explain the density of the
/// points (PointDensity), each moved until what the front surfaces hide is just what is missing behind them (Shadows).
/// Good to some hundredths of the range, seldom a tenth, most of it along the line of sight, where it hides and reveals
/// least.
/// Nothing, if no place explains the points: a merged or evenly thinned cloud, too few points, too much noise.
/// `density` is that of `points`; a rival is looked from with the same cells. The result does not depend on the number
/// of threads.
[[nodiscard]] std::optional<FoundViewpoint> find_viewpoint(std::span<const Eigen::Vector3f> points,
                                                           const PointDensity& density, double noise_sigma_mm,
                                                           const std::optional<Eigen::Vector3d>& rival_in_scan,
                                                           const Context& context);

}  // namespace asbuilt::scan
