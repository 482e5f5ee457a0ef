// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/context.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::model {

/// Builds what is not stored but follows from the rest: box, face normals, surface, field, rays.
/// Needs skin, diameter, sampling_distance, samples.
void build_search_structures(PreparedModel& model, const Context& context);
/// The part of it that inspection asks: field and rays stay null, the thickness of walls unknown (0).
void build_inspection_structures(PreparedModel& model);

}  // namespace asbuilt::model
