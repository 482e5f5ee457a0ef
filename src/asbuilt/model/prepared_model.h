// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/io/cad_face_name.h"
#include "asbuilt/model/distance_field.h"
#include "asbuilt/model/ray_scene.h"
#include "asbuilt/model/surface_distance.h"
#include "asbuilt/model/symmetry.h"

namespace asbuilt::model {

struct ModelOptions {
  double sampling_ratio = 0.0;  ///< tau: detection sampling / diameter, paper 0.025-0.05; 0 chooses it from the part
  double occlusion_threshold = 0.97;  ///< faces with more of their hemisphere blocked on both sides are inner (0-1]
  int occlusion_rays = 64;            ///< rays per face sample and side
  bool keep_inner = false;            ///< skip the removal of inner geometry

  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(ModelOptions& options, Visitor&& field) {
  field("sampling_ratio", options.sampling_ratio, "tau, sampling distance / diameter (0: chosen from the part)");
  field("occlusion_threshold", options.occlusion_threshold, "ambient occlusion above which a face is inner");
  field("occlusion_rays", options.occlusion_rays, "rays per face and side for ambient occlusion");
  field("keep_inner", options.keep_inner, "keep inner geometry");
}

/// What preparation found and did.
struct PreparationReport {
  std::size_t triangles_in = 0, vertices_welded = 0, degenerate_dropped = 0, duplicates_dropped = 0;
  std::size_t inner_dropped = 0, flipped = 0;
  std::size_t open_edges = 0;  ///< of the skin; 0 for a closed one
  double thin_wall = 0.0;      ///< mm; nine tenths of the samples lie on thicker walls; infinity for a sheet
  std::vector<std::string> notes;
};

/// The CAD prior, ready for every stage. All in the model frame, mm. Immutable and cheap to share.
struct PreparedModel {
  TriangleMesh skin;                          ///< welded outer skin, oriented outwards
  std::vector<Eigen::Vector3f> face_normals;  ///< of the skin's triangles, unit length, outwards
  Eigen::AlignedBox3d box;                    ///< of the skin
  double diameter = 0.0;                      ///< the box's diagonal
  double sampling_distance = 0.0;             ///< d = tau * diameter
  PointCloud samples;        ///< even (blue-noise) oriented samples, spacing about d; normals fitted over radius ~d
  PointCloud dense_samples;  ///< the same at about d / 3 (at most 60 000), face normals
  double dense_sample_area_mm2 = 0.0;  ///< of the skin, per dense sample
  std::shared_ptr<const SurfaceDistance> surface;
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const RayScene> rays;
  SymmetryGroup symmetry;  ///< the rotations that map the part onto itself, and those that nearly do
  PreparationReport report;
  io::CadFaceNames face_names;  ///< of the CAD faces by the numbers of skin.cad_faces, set by whoever read them
  std::string source_path, source_sha256;  ///< of the file it came from, set by whoever read it; may be empty

  /// Whether a sensor may see faces from behind: sheets and shells without thickness have two sides.
  [[nodiscard]] bool is_open() const { return report.open_edges > 0; }
};

/// Triangle soup in, outer skin, even samples and search structures out (Sec. 4, first paragraph).
/// Errors: not_possible for a mesh without area, or of which nothing remains; cancelled.
[[nodiscard]] Result<PreparedModel> prepare(const TriangleMesh& mesh, const ModelOptions& options,
                                            const Context& context);

/// Evenly spread (blue-noise) oriented samples of a mesh with about `spacing_mm` between neighbours: Poisson-disk
/// elimination over a dense area-weighted draw. Normals are face normals. Deterministic for a seed.
///
/// No two samples are closer than 0.85 spacings, unless their normals are more than 120 degrees apart: the two sides of
/// a thin wall are sampled each on its own. Samples come in random order, so that the first n are spread out, too.
[[nodiscard]] PointCloud even_samples(const TriangleMesh& mesh, double spacing_mm, std::uint64_t seed,
                                      const Context& context);

}  // namespace asbuilt::model
