// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/refine/refine.h"

namespace asbuilt::refine {

/// The one rigid motion `model_from_refined` that best fits all segments to the CAD (robust, no scale):
/// architecture.md, section 3, refine. Apply it on the left of every refined pose.
///
/// Levenberg-Marquardt on exact signed distances of an even sample of the union, so that what many scans saw, or one
/// scan saw densely, counts no more than the rest. Only the side of a wall that a point's normal faces attracts it. The
/// Tukey loss starts at 5 % of the diameter and follows the median residual down: as-built deviation widens it by
/// itself, and only what stands out from the part's own deviations is left out. Directions that the CAD does not hold
/// (a sphere, a shaft) stay as they are.
/// Errors: invalid_argument (as many poses as views, a positive diameter), not_possible (no point near the surface),
/// cancelled.
[[nodiscard]] Result<Pose> best_fit_gauge(std::span<const View> views, std::span<const Pose> refined_from_scan,
                                          const model::SurfaceDistance& surface, double diameter_mm,
                                          const Context& context);

/// Where the joint refinement shall begin with this view: its own pose, or, if more than a tenth of its points lie
/// further off the CAD than parts deviate from theirs (1 % of the diameter), that pose fitted to the CAD, provided that
/// this halves their share. A fit that ends elsewhere is begun anew from 12 starts around. Scan against scan, a start
/// that is 6 degrees off finds too little in common; scan against CAD, nothing is missing. Found poses have been fitted
/// before and stay as they are, to the bit. Errors: invalid_argument (no normals, no diameter), cancelled.
[[nodiscard]] Result<Pose> start_near_model(const View& view, const model::SurfaceDistance& surface, double diameter_mm,
                                            const Context& context);

/// The view fitted to the CAD from its own pose, as the gauge is. Its information is that of a part whose
/// deviations have the size of the residuals and are alike within patches, of which a view has but a few.
/// Errors: invalid_argument (no normals, no diameter), not_possible (no point near the surface), cancelled.
[[nodiscard]] Result<ModelFit> fit_to_model(const View& view, const model::SurfaceDistance& surface, double diameter_mm,
                                            const Context& context);

}  // namespace asbuilt::refine
