// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>

namespace asbuilt::inspect {

/// Where scattered heights are highest, or lowest.
struct Extremum {
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  double height = 0.0;
  double variance = 0.0;  ///< of the height: from noise, from too few points, and from how rough the surface is
};

/// The extremum towards `sign` (+1 or -1) of the surface that heights z over places (x, y) were measured on.
///
/// Nothing is assumed of its shape but that it is continuous, with slopes, and about as rough in one place as in
/// another: the heights are taken for a random field with a Matern covariance of order 3/2 (Stein, Interpolation of
/// Spatial Data, 1999) and noise. Its range, amplitude and the noise are those under which the heights are most likely
/// (restricted maximum likelihood; the mean is unknown). The height is then the best linear unbiased prediction, and
/// its variance that of the prediction, which grows where the surface is rough and points are few. A polynomial, whose
/// variance knows of noise alone, levels what it cannot follow, and does not say so.
///
/// Looked for at the places themselves and half-way to their neighbours, no further than `reach` from the origin;
/// beyond the outermost places nothing is guessed. Heights beyond Tukey's outer fences of their neighbours' are left
/// out. Where there are more than some 200 places, means over small squares stand for them.
///
/// Nothing, if there are fewer than twelve places. Cost: some 30 ms.
[[nodiscard]] std::optional<Extremum> extremum_of(std::span<const Eigen::Vector3d> heights, double sign, double reach);

}  // namespace asbuilt::inspect
