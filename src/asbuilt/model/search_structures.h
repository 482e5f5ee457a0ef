// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "asbuilt/core/context.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::model {

/// Builds what is not stored but follows from the rest: box, face normals, surface, field, rays.
/// Needs skin, diameter, sampling_distance, samples.
void build_search_structures(PreparedModel& model, const Context& context);

}  // namespace asbuilt::model
