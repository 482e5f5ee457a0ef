// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/refine/refine.h"

namespace asbuilt::refine {

/// refine(), and once more with the CAD's help if that is not enough (Refinement::firmly_held;
/// RefineOptions::loose_on_model). Each view then starts from its fit to the CAD (fit_to_model) and is held there as
/// firmly as a part with these deviations is known to lie, and ends of faces are matched. Of scans that hold one
/// another firmly the CAD says nothing, as in the paper; nor while they contradict one of them (view_against_others)
/// that does not lie on it either, which is to be dropped first. Errors: as refine().
[[nodiscard]] Result<Refinement> refine_on_model(std::span<const View> views, std::span<const Link> links,
                                                 const model::SurfaceDistance& surface, double diameter_mm,
                                                 const RefineOptions& options, const Context& context);

}  // namespace asbuilt::refine
