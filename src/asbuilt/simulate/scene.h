// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/simulate/options.h"
#include "asbuilt/simulate/scanner.h"

namespace asbuilt::simulate {

/// A further placement of the part.
struct PlacedCopy {
  Pose world_from_model = Pose::Identity();
  double occlusion = 1.0, hidden = 1.0;  ///< as those of the scene, for this placement
};

/// Everything that one scan sees, in a world whose floor is z = 0. Mesh 0 is floor and walls, mesh 1 the part (empty
/// when absent), then come its further placements, and after them the clutter.
struct Scene {
  static constexpr std::uint32_t kSurroundings = 0, kPart = 1, kFirstCopy = 2;

  std::vector<TriangleMesh> meshes_in_world;
  std::optional<Pose> world_from_model;
  std::vector<PlacedCopy> copies;  ///< number k is mesh kFirstCopy + k
  Sensor sensor;
  double occlusion = 1.0;  ///< 1 - visible area of the part / its whole area
  double hidden = 1.0;     ///< 1 - visible area of the part / that without the other things
  double clutter = 1.0;    ///< 1 - visible area of the part / area of all that is seen
};

/// Distance from sensor to part around which the noise is stated.
[[nodiscard]] double middle_distance_mm(SensorKind kind, double diameter_mm);

/// Arranges scan number `index`: part, sensor, further placements of the part, things standing, lying and leaning
/// around, things in the way. Placings are drawn until all placements are there and clutter and hidden share lie in
/// their ranges; of 8 without success the one that comes closest.
/// `part_in_model` is the as-built mesh; `has_part` false leaves it out. Nothing intersects the part. `companions` are
/// things that stand around in addition to the random ones; without the part, the first takes its place.
[[nodiscard]] Scene arrange(const TriangleMesh& part_in_model, const SimulateOptions& options, const NoiseModel& noise,
                            std::uint64_t index, bool has_part, const Context& context,
                            std::span<const TriangleMesh> companions = {});

}  // namespace asbuilt::simulate
