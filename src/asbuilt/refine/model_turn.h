// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/refine/refine.h"

namespace asbuilt::refine {

/// An axis about which the part is nearly symmetric in any turn, in the model frame.
struct TurnAxis {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit length
  Eigen::Vector3d point = Eigen::Vector3d::Zero();       ///< on it, mm
  double period_rad = 0.0;                               ///< a turn that maps the part onto itself; 2 pi if none does
};

struct ModelTurn {
  double angle_rad = 0.0;  ///< about the axis, to be put before the view's pose; 0 within half a step of its own
  bool is_told = false;    ///< the CAD is met at this turn clearly better than at any other
};

/// The turn about `axis` at which a view meets the CAD best. Of a part that is nearly symmetric in any turn (a rotor
/// with low ribs) little tells the turns apart, and a detection may stand between. All turns of a period are tried, in
/// steps of 0.3 % of the diameter at the outermost point, with 6000 points whose distances count up to three robust
/// scales. By how much other turns differ among themselves is the measure of what chance and as-built deviations do:
/// the turn is told if the best of those more than four steps away is worse by 2.5 of their robust standard deviations.
/// Errors: invalid_argument (no normals, diameter or period), cancelled.
[[nodiscard]] Result<ModelTurn> turn_on_model(const View& view, const model::SurfaceDistance& surface,
                                              double diameter_mm, const TurnAxis& axis, const Context& context);

}  // namespace asbuilt::refine
