// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/inspect/deviation.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/surface_mesh.h"

namespace asbuilt::report {

/// The part's surface with what was measured at each vertex: what pictures and the page are made of.
struct Scene {
  static constexpr std::uint16_t kNone = 65535;
  model::SurfaceMesh mesh;
  std::vector<std::uint32_t> face_of_triangle;  ///< index into the report's faces
  std::vector<inspect::Spot> spots;             ///< one a vertex
  std::vector<std::uint16_t> region;            ///< one a vertex: index into the report's regions, kNone: none
};

/// The skin split to about one and a half spacings of the dense samples, at most some 150 000 triangles.
[[nodiscard]] Scene scene_of(const model::PreparedModel& model, const inspect::DeviationReport& deviations,
                             const Context& context);

/// SCENE_JSON of docs/report-json.md.
[[nodiscard]] std::string scene_json(const Scene& scene, const io::RunRecord& record);

}  // namespace asbuilt::report
