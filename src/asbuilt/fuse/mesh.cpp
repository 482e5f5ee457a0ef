// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "asbuilt/core/median.h"
#include "asbuilt/fuse/mesh_clean.h"
#include "asbuilt/fuse/mesh_field.h"
#include "asbuilt/fuse/mesh_grid.h"

namespace asbuilt::fuse {
namespace {

constexpr std::size_t kFewestPoints = 20;
constexpr double kCellInWidths = 1.25;
constexpr double kFinestCellInSpacings = 0.4;    // below, nodes would outnumber samples a hundred to one
constexpr double kMostCellsAlongAxis = 1 << 19;  // half of what a VoxelKey holds

Result<void> check(const PointCloud& cloud) {
  if (cloud.size() < kFewestPoints) {
    return fail(ErrorCode::not_possible,
                fmt::format("a surface mesh needs at least {} points, the cloud has {}", kFewestPoints, cloud.size()));
  }
  if (cloud.normals.size() != cloud.size()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("a surface mesh needs a normal for each point, there are {} for {}", cloud.normals.size(),
                            cloud.size()));
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const bool is_good = cloud.positions[i].allFinite() && cloud.normals[i].allFinite() && !cloud.normals[i].isZero();
    if (!is_good) {
      return fail(ErrorCode::invalid_argument, fmt::format("point {} has no finite position and unit normal", i));
    }
  }
  return {};
}

double median_sigma(const Reconstruction& reconstruction) {
  if (reconstruction.sigma_mm.empty()) return 0.0;
  const float sigma = median_of(reconstruction.sigma_mm);
  return std::isfinite(sigma) ? static_cast<double>(sigma) : 0.0;
}

Result<void> check_cell(double cell_mm, const FieldSamples& samples) {
  if (cell_mm < kFinestCellInSpacings * samples.base_width_mm) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("mesh_cell = {} mm is too fine for a cloud with a spacing of {:.3g} mm", cell_mm,
                            samples.base_width_mm));
  }
  Eigen::Array3f low = samples.cloud.positions.front(), high = low;
  for (const Eigen::Vector3f& point : samples.cloud.positions) {
    low = low.min(point.array());
    high = high.max(point.array());
  }
  const double extent = static_cast<double>((high - low).maxCoeff());
  if (extent > kMostCellsAlongAxis * cell_mm) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("cells of {} mm are too small for an extent of {} mm", cell_mm, extent));
  }
  return {};
}

}  // namespace

Result<void> MeshOptions::validate() const {
  if (!(cell_mm >= 0.0 && std::isfinite(cell_mm))) {
    return fail(ErrorCode::invalid_argument, fmt::format("mesh_cell = {} mm must not be negative", cell_mm));
  }
  if (!(max_hole_spacings >= 0.8 && max_hole_spacings <= 2.2)) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("mesh_max_hole_spacings = {} must be in [0.8, 2.2]", max_hole_spacings));
  }
  if (min_component_triangles < 0) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("mesh_min_component_triangles = {} must not be negative", min_component_triangles));
  }
  return {};
}

Result<TriangleMesh> surface_mesh(const Reconstruction& reconstruction, const MeshOptions& options,
                                  const Context& context) {
  const auto cancelled = [] { return fail(ErrorCode::cancelled, "cancelled while meshing the surface"); };
  ASBUILT_CHECK(options.validate());
  ASBUILT_CHECK(check(reconstruction.cloud));
  const FieldSamples samples =
      field_samples(reconstruction.cloud, median_sigma(reconstruction), options.cell_mm, context);
  if (context.cancelled()) return cancelled();
  if (!(samples.base_width_mm > 0.0)) {
    return fail(ErrorCode::not_possible, "the points coincide, there is no surface to mesh");
  }
  const double cell = options.cell_mm > 0.0 ? options.cell_mm : kCellInWidths * samples.base_width_mm;
  ASBUILT_CHECK(check_cell(cell, samples));

  const SurfaceField field(samples, context);
  TriangleMesh mesh = supported_surface(field, samples, cell, options.max_hole_spacings, context);
  if (context.cancelled()) return cancelled();
  separate_shared_edges(mesh);
  mesh = without_small_pieces(mesh, options.min_component_triangles);
  context.report_progress(1.0);
  if (mesh.empty()) {
    return fail(ErrorCode::not_possible, "the points are too few or too scattered to make a surface");
  }
  return mesh;
}

}  // namespace asbuilt::fuse
