// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/scan/normals.h"
#include "asbuilt/scan/point_density.h"
#include "asbuilt/scan/viewpoint_search.h"

namespace asbuilt::scan {
namespace {

constexpr std::size_t kFewestPoints = 3;

// Whether a found viewpoint is to be believed, and not an origin that is possible by the depth order. A cloud that was
// thinned has lost its density, but not what hides behind what.
bool is_clearer_than_rival(const FoundViewpoint& found, double misfit_of_rival) {
  constexpr double kClearer = 0.65, kTimes = 5.0, kLeastHidden = 0.005, kLeastMisfit = 0.05;
  const auto is_far_less = [](double own, double of_rival, double least) {
    return of_rival > kTimes * own && of_rival > own + least;
  };
  return found.density_misfit < kClearer * misfit_of_rival &&
         (is_far_less(found.shadows.hidden, found.shadows_of_rival.hidden, kLeastHidden) ||
          is_far_less(found.shadows.misfit(), found.shadows_of_rival.misfit(), kLeastMisfit));
}

/// Decides where the sensor stood. `tree` is of the scan's points.
void choose_viewpoint(Scan& scan, std::span<const Eigen::Vector3f> file_normals,
                      const std::optional<Eigen::Vector3d>& file_viewpoint, const ViewpointRequest& request,
                      const KdTree& tree, const Context& context) {
  const auto take = [&](const Viewpoint& viewpoint, ViewpointSource source) {
    scan.viewpoint = viewpoint;
    scan.viewpoint_source = source;
  };
  if (!request.automatic) {
    return take(request.stated, request.stated.known() ? ViewpointSource::stated : ViewpointSource::none);
  }
  if (file_viewpoint) return take({Viewpoint::Kind::point, *file_viewpoint}, ViewpointSource::file);

  const auto density_of = [&](std::size_t most) {
    return PointDensity(scan.cloud.positions, scan.cloud.normals, scan.surface_variation, tree, scan.noise_sigma_mm,
                        most, context);
  };
  const auto agrees = [&](const Viewpoint& viewpoint) {
    return agrees_with_depth_order(scan.cloud.positions, scan.cloud.normals, file_normals, scan.spacing_mm, viewpoint);
  };
  // A hall, and a scene seen from behind, are in order from the wrong place, too; the density of their points is not.
  constexpr std::size_t kFew = 600, kMany = 3000;
  constexpr double kClearMisfit = 0.2, kClearToEven = 0.7;
  const Viewpoint origin{Viewpoint::Kind::point, Eigen::Vector3d::Zero()};
  const bool may_be_origin = request.may_be_origin && agrees(origin);
  double misfit_of_origin = 0.0;
  if (may_be_origin) {
    const PointDensity density = density_of(kFew);
    if (!density.known()) return take(origin, ViewpointSource::origin);
    misfit_of_origin = density.misfit(origin.value);
    const bool is_clear = misfit_of_origin <= std::min(kClearMisfit, kClearToEven * density.misfit_of_even());
    if (is_clear) return take(origin, ViewpointSource::origin);
  }
  std::optional<FoundViewpoint> found;
  if (request.may_be_sought) {
    const auto rival = may_be_origin ? std::optional(origin.value) : std::nullopt;
    found = find_viewpoint(scan.cloud.positions, density_of(kMany), scan.noise_sigma_mm, rival, context);
  }
  if (found && (!may_be_origin || is_clearer_than_rival(*found, misfit_of_origin))) {
    const Viewpoint viewpoint{Viewpoint::Kind::point, found->position_in_scan};
    if (agrees(viewpoint)) {
      scan.warnings.push_back(
          "the sensor did not stand at the scan's origin; where it stood was found from the points, and is known to a "
          "tenth of its distance or so: state it with --viewpoint if you know it");
      return take(viewpoint, ViewpointSource::points);
    }
  }
  if (may_be_origin) return take(origin, ViewpointSource::origin);
  scan.warnings.push_back(
      "the sensor did not stand at the scan's origin, and the points do not tell where it did, so no viewpoint is "
      "used; "
      "state it with --viewpoint");
}

void turn(std::vector<Eigen::Vector3f>& normals, const Context& context, const auto& wanted_direction) {
  parallel_for(context, normals.size(), 4096, [&](std::size_t i) {
    if (normals[i].dot(wanted_direction(i)) < 0.0F) normals[i] = -normals[i];
  });
}

// Signs from the viewpoint, else from the file (whose normals give the sign at most), else none.
bool orient_normals(Scan& scan, std::span<const Eigen::Vector3f> file_normals, bool use_file, const Context& context) {
  if (scan.viewpoint.known()) {
    turn(scan.cloud.normals, context, [&](std::size_t i) -> Eigen::Vector3f {
      return scan.viewpoint.towards_sensor(scan.cloud.positions[i].cast<double>()).cast<float>();
    });
    return true;
  }
  if (!use_file || file_normals.empty()) return false;
  turn(scan.cloud.normals, context, [&](std::size_t i) { return file_normals[i]; });
  return true;
}

}  // namespace

Result<void> ScanOptions::validate() const {
  if (noise_sigma_mm >= 0.0 && std::isfinite(noise_sigma_mm)) return {};
  return fail(ErrorCode::invalid_argument,
              fmt::format("the sensor noise is {} mm, expected a finite number of at least 0", noise_sigma_mm));
}

Result<Scan> prepare_scan(const PointCloud& raw, const std::optional<Eigen::Vector3d>& file_viewpoint,
                          const ViewpointRequest& request, const ScanOptions& options, const Context& context) {
  ASBUILT_CHECK(options.validate());
  Sanitised clean = sanitise(raw, context);
  const SanitiserReport& report = clean.report;
  if (clean.cloud.size() < kFewestPoints) {
    return fail(
        ErrorCode::unreadable_input,
        fmt::format("{} usable points of {} ({} not finite, {} at the origin, {} duplicates), expected at least {}",
                    clean.cloud.size(), report.points_in, report.not_finite, report.no_return, report.duplicates,
                    kFewestPoints));
  }

  Scan scan;
  scan.source_index = std::move(clean.source_index);
  scan.report = report;
  scan.cloud.positions = std::move(clean.cloud.positions);
  const std::vector<Eigen::Vector3f> file_normals = std::move(clean.cloud.normals);

  const KdTree tree(scan.cloud.positions, context);
  scan.spacing_mm = median_spacing(scan.cloud.positions, tree);
  scan.noise_sigma_mm =
      options.noise_sigma_mm > 0.0 ? options.noise_sigma_mm : estimate_noise(scan.cloud.positions, tree, context);
  FittedNormals fitted = fitted_normals(scan.cloud.positions, tree, scan.spacing_mm,
                                        neighbours_for_normals(scan.noise_sigma_mm, scan.spacing_mm), context);
  scan.cloud.normals = std::move(fitted.normals);
  scan.surface_variation = std::move(fitted.variation);
  if (context.cancelled()) return fail(ErrorCode::cancelled, "stopped while preparing a scan");
  choose_viewpoint(scan, file_normals, file_viewpoint, request, tree, context);
  if (context.cancelled()) return fail(ErrorCode::cancelled, "stopped while preparing a scan");
  scan.spacing_by_range = SpacingByRange(scan.cloud.positions, tree, scan.viewpoint);
  scan.normals_oriented = orient_normals(scan, file_normals, options.use_file_normals, context);
  return scan;
}

PointCloud downsample(const Scan& scan, double spacing_mm, double normal_radius_mm, const Context& context) {
  const std::vector<Eigen::Vector3f>& positions = scan.cloud.positions;
  const std::vector<std::uint32_t> chosen = even_subset(positions, spacing_mm, context);
  // A fit needs some hundred points at most: thin the source first where it is denser than that.
  constexpr double kFitPointsAcross = 14.0;
  const double fit_spacing = 2.0 * normal_radius_mm / kFitPointsAcross;
  std::vector<Eigen::Vector3f> source;
  if (scan.spacing_mm < 0.7 * fit_spacing) {
    for (const std::uint32_t i : even_subset(positions, fit_spacing, context)) source.push_back(positions[i]);
  } else {
    source = positions;
  }
  const KdTree tree(source, context);

  PointCloud samples;
  samples.positions.resize(chosen.size());
  samples.normals.resize(chosen.size());
  parallel_for_blocks(context, chosen.size(), 256, [&](std::size_t begin, std::size_t end) {
    constexpr std::size_t kFewest = 8;
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f& point = positions[chosen[i]];
      const Eigen::Vector3f& fine_normal = scan.cloud.normals[chosen[i]];
      samples.positions[i] = point;
      samples.normals[i] = fine_normal;
      tree.within(point, static_cast<float>(normal_radius_mm), neighbours);
      if (neighbours.size() < kFewest) continue;
      const Eigen::Vector3f coarse_normal = fit_plane(source, neighbours).normal;
      if (coarse_normal.isZero(0.0F)) continue;
      samples.normals[i] = coarse_normal.dot(fine_normal) < 0.0F ? Eigen::Vector3f(-coarse_normal) : coarse_normal;
    }
  });
  // Where the coarse fit turned a normal past the silhouette, the viewpoint has the last word.
  if (scan.viewpoint.known()) {
    turn(samples.normals, context, [&](std::size_t i) -> Eigen::Vector3f {
      return scan.viewpoint.towards_sensor(samples.positions[i].cast<double>()).cast<float>();
    });
  }
  return samples;
}

}  // namespace asbuilt::scan
