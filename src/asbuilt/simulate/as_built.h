// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::simulate {

/// A round dent (negative height) or boss (positive) with soft edges, on the side of the surface that `normal` names.
struct Bump {
  Eigen::Vector3d centre_in_model = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double radius_mm = 0.0;
  double height_mm = 0.0;  ///< at the centre; falls off as (1 - r^2/R^2)^2
};

struct AsBuiltOptions {
  double warp_ratio = 0.002;         ///< largest displacement by the smooth warp / diameter, [0, 0.05]
  double scale = 1.0;                ///< as-built size / CAD size, [0.9, 1.1]
  int dents = 1;                     ///< dents at places drawn evenly over the surface, [0, 100]
  int bosses = 0;                    ///< likewise, outwards
  double bump_height_ratio = 0.005;  ///< depth of dents and height of bosses / diameter, [0, 0.05]
  double bump_radius_ratio = 0.05;   ///< their radius / diameter, (0, 0.5]

  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(AsBuiltOptions& options, Visitor&& field) {
  field("warp_ratio", options.warp_ratio, "largest displacement by the smooth as-built warp / diameter");
  field("scale", options.scale, "as-built size / CAD size");
  field("dents", options.dents, "dents in the as-built surface");
  field("bosses", options.bosses, "bosses on the as-built surface");
  field("bump_height_ratio", options.bump_height_ratio, "depth of a dent and height of a boss / diameter");
  field("bump_radius_ratio", options.bump_radius_ratio, "radius of a dent or boss / diameter");
}

/// What was really built, in the model frame, and how far it is from the CAD (over the surface, vertex by vertex).
struct AsBuilt {
  TriangleMesh mesh;
  std::vector<Bump> bumps;
  double deviation_rms_mm = 0.0;
  double deviation_max_mm = 0.0;
};

/// The mesh with bumps; triangles around them are made small first. Other triangles stay as they are.
[[nodiscard]] TriangleMesh with_bumps(const TriangleMesh& mesh, std::span<const Bump> bumps);

/// Warps, scales and dents a part. Large triangles are split before. The result is moved by the rigid motion that
/// brings its surface closest to the CAD's point for point, so that only its shape differs. The same for a seed.
/// Errors: invalid_argument from validate(); not_possible for a mesh without area.
[[nodiscard]] Result<AsBuilt> as_built(const TriangleMesh& cad, const AsBuiltOptions& options, std::uint64_t seed);

}  // namespace asbuilt::simulate
