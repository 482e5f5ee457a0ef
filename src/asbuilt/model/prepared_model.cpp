// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/prepared_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/model/face_visibility.h"
#include "asbuilt/model/mesh_cleaning.h"
#include "asbuilt/model/mesh_edges.h"
#include "asbuilt/model/outer_skin.h"
#include "asbuilt/model/sample_normals.h"
#include "asbuilt/model/sampling_choice.h"
#include "asbuilt/model/search_structures.h"
#include "asbuilt/model/symmetry_search.h"

namespace asbuilt::model {
namespace {

constexpr double kWeldTolerance = 1e-6;  // of the diameter: half a micrometre on half a metre
constexpr double kMostDenseSamples = 60000.0;
constexpr double kDenseRatio = 3.0;  // sampling distance / dense sampling distance
constexpr double kReach = 0.1;       // of the diameter, at least three sampling distances
constexpr std::uint64_t kSeed = 1;

Result<void> check_mesh(const TriangleMesh& mesh) {
  if (mesh.empty()) {
    return fail(ErrorCode::not_possible, "the model has no triangles; a surface mesh is needed, not points or curves");
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const int vertex = mesh.triangles[i][k];
      if (vertex < 0 || static_cast<std::size_t>(vertex) >= mesh.vertices.size()) {
        return fail(ErrorCode::invalid_argument, fmt::format("triangle {} of the model names vertex {}, there are {}",
                                                             i, vertex, mesh.vertices.size()));
      }
      const Eigen::Vector3d& p = mesh.vertices[static_cast<std::size_t>(vertex)];
      if (!p.allFinite()) {
        return fail(
            ErrorCode::not_possible,
            fmt::format("vertex {} of the model is ({}, {}, {}); export the model again with finite coordinates",
                        vertex, p.x(), p.y(), p.z()));
      }
    }
  }
  return {};
}

// Vertices that no triangle uses may be anything, even NaN: they must not reach the search for close pairs.
TriangleMesh used_part(const TriangleMesh& mesh) {
  return subset(mesh, std::vector<std::uint8_t>(mesh.triangles.size(), 1));
}

Result<CleanedMesh> clean(const TriangleMesh& mesh) {
  const double whole = diameter(mesh);
  if (!(whole > 0.0) || !std::isfinite(whole)) {
    return fail(ErrorCode::not_possible,
                fmt::format("the model's {} triangles have an extent of {} mm; check the file and its unit",
                            mesh.triangles.size(), whole));
  }
  CleanedMesh result = cleaned(mesh, kWeldTolerance * whole);
  if (result.mesh.empty()) {
    return fail(ErrorCode::not_possible,
                fmt::format("all {} triangles of the model are without area; export it as a surface mesh",
                            mesh.triangles.size()));
  }
  return result;
}

tl::unexpected<Error> cancelled() { return fail(ErrorCode::cancelled, "the preparation of the model was stopped"); }

void note_findings(PreparationReport& report, double inner_share) {
  if (report.inner_dropped > 0) {
    report.notes.push_back(fmt::format("{} inner faces, {:.0f} % of the area, were dropped; --keep-inner keeps them",
                                       report.inner_dropped, 100.0 * inner_share));
  }
  if (report.flipped > 0) report.notes.push_back(fmt::format("{} faces were turned outwards", report.flipped));
  if (report.open_edges > 0) {
    report.notes.push_back(
        fmt::format("the skin is open along {} edges; distances have no sign next to them", report.open_edges));
  }
}

PointCloud dense_samples_of(const TriangleMesh& skin, double sampling_distance, const Context& context) {
  const double affordable = std::sqrt(surface_area(skin) / kMostDenseSamples);
  PointCloud dense = even_samples(skin, std::max(sampling_distance / kDenseRatio, affordable), kSeed + 1, context);
  const std::size_t count = std::min(dense.size(), static_cast<std::size_t>(kMostDenseSamples));
  dense.positions.resize(count);  // the first ones are spread out, too
  dense.normals.resize(count);
  return dense;
}

}  // namespace

Result<void> ModelOptions::validate() const {
  const auto refuse = [](const char* name, double value, const char* expected) {
    return fail(ErrorCode::invalid_argument, fmt::format("{} is {}, it must be {}", name, value, expected));
  };
  const bool ratio_makes_sense = sampling_ratio == 0.0 || (sampling_ratio >= 0.005 && sampling_ratio <= 0.2);
  if (!ratio_makes_sense) return refuse("sampling_ratio", sampling_ratio, "0 or in [0.005, 0.2]");
  const bool threshold_makes_sense = occlusion_threshold > 0.0 && occlusion_threshold <= 1.0;
  if (!threshold_makes_sense) return refuse("occlusion_threshold", occlusion_threshold, "in (0, 1]");
  if (occlusion_rays < 16 || occlusion_rays > 4096) return refuse("occlusion_rays", occlusion_rays, "in [16, 4096]");
  return {};
}

void build_inspection_structures(PreparedModel& model) {
  const TriangleMesh& skin = model.skin;
  model.box = bounding_box(skin);
  model.dense_sample_area_mm2 = surface_area(skin) / static_cast<double>(model.dense_samples.size());
  model.face_normals.resize(skin.triangles.size());
  for (std::size_t i = 0; i < skin.triangles.size(); ++i) {
    model.face_normals[i] = doubled_area_vector(skin, i).stableNormalized().cast<float>();
  }
  model.surface = std::make_shared<const SurfaceDistance>(skin);
}

void build_search_structures(PreparedModel& model, const Context& context) {
  build_inspection_structures(model);
  const TriangleMesh& skin = model.skin;
  model.rays = std::make_shared<const RayScene>(skin);
  model.report.thin_wall = thin_wall(model.samples, *model.rays, model.diameter);
  const double voxel = choose_voxel(model.diameter, surface_area(skin), model.report.thin_wall);
  const double reach = std::max(kReach * model.diameter, 3.0 * model.sampling_distance);
  model.field = std::make_shared<const DistanceField>(skin, *model.surface, voxel, reach, context);
}

Result<PreparedModel> prepare(const TriangleMesh& mesh, const ModelOptions& options, const Context& context) {
  ASBUILT_CHECK(options.validate());
  ASBUILT_CHECK(check_mesh(mesh));
  ASBUILT_TRY(clean_mesh, clean(used_part(mesh)));
  context.report_progress(0.1);

  const RayScene rays(clean_mesh.mesh);
  const VisibilityOptions looking{options.occlusion_threshold, options.occlusion_rays};
  const SeenMesh seen = options.keep_inner
                            ? SeenMesh{clean_mesh.mesh, face_visibility(clean_mesh.mesh, rays, looking, context)}
                            : split_where_hidden(clean_mesh.mesh, rays, looking, context);
  if (context.cancelled()) return cancelled();
  context.report_progress(0.4);

  OuterSkin skin = outer_skin(seen.mesh, seen.visibility, options.keep_inner);
  if (skin.mesh.empty()) {
    return fail(ErrorCode::not_possible,
                fmt::format("none of the model's {} faces can be seen from outside at an occlusion threshold of {}; "
                            "raise it, or use --keep-inner",
                            clean_mesh.mesh.triangles.size(), options.occlusion_threshold));
  }

  PreparedModel model;
  model.report.triangles_in = mesh.triangles.size();
  model.report.vertices_welded = clean_mesh.vertices_welded;
  model.report.degenerate_dropped = clean_mesh.degenerate_dropped;
  model.report.duplicates_dropped = clean_mesh.duplicates_dropped;
  model.report.inner_dropped = skin.inner_dropped;
  model.report.flipped = skin.flipped;
  model.report.open_edges = count_open_edges(skin.mesh);
  note_findings(model.report, skin.inner_area / (skin.inner_area + surface_area(skin.mesh)));
  model.skin = std::move(skin.mesh);
  model.diameter = bounding_box(model.skin).diagonal().norm();
  const double ratio = options.sampling_ratio > 0.0 ? options.sampling_ratio : choose_sampling_ratio(model.skin);
  model.sampling_distance = ratio * model.diameter;
  model.dense_samples = dense_samples_of(model.skin, model.sampling_distance, context);
  model.samples = even_samples(model.skin, model.sampling_distance, kSeed, context);
  model.samples.normals = fitted_normals(model.samples, model.dense_samples, model.sampling_distance, context);
  if (context.cancelled()) return cancelled();
  context.report_progress(0.6);

  build_search_structures(model, context);
  if (context.cancelled()) return cancelled();
  context.report_progress(0.9);
  model.symmetry = find_symmetry(model, context);
  if (context.cancelled()) return cancelled();
  context.report_progress(1.0);
  return model;
}

}  // namespace asbuilt::model
