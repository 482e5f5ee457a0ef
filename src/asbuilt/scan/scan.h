// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/result.h"
#include "asbuilt/scan/sanitise.h"
#include "asbuilt/scan/spacing_by_range.h"
#include "asbuilt/scan/viewpoint.h"

namespace asbuilt::scan {

struct ScanOptions {
  double noise_sigma_mm = 0.0;   ///< 1 sigma of the sensor along its rays; 0 estimates it
  bool use_file_normals = true;  ///< take the sign of the normals from the file when no viewpoint is known

  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(ScanOptions& options, Visitor&& field) {
  field("noise", options.noise_sigma_mm, "sensor noise, 1 sigma in mm (0: estimated from the scan)");
  field("use_file_normals", options.use_file_normals,
        "take the sign of normals from the file if no viewpoint is known");
}

/// A sanitised scan at full density, in the scan frame (minus the file's offset), mm.
struct Scan {
  PointCloud cloud;                         ///< normals fitted over a few neighbours, sign: see `normals_oriented`
  std::vector<float> surface_variation;     ///< of the fit behind each normal: near 0 where flat, large on edges
  std::vector<std::uint32_t> source_index;  ///< row of each point in the file
  Viewpoint viewpoint;
  ViewpointSource viewpoint_source = ViewpointSource::none;
  bool normals_oriented = false;  ///< whether the sign of the normals means anything
  double spacing_mm = 0.0;        ///< median distance between neighbours
  SpacingByRange spacing_by_range;
  double noise_sigma_mm = 0.0;
  SanitiserReport report;
  std::vector<std::string> warnings;

  /// Distance between neighbouring measurements at a place, mm; the median where nothing is known of its change.
  [[nodiscard]] double spacing_at(const Eigen::Vector3d& point_in_scan) const {
    return spacing_by_range.known() ? spacing_by_range.at(point_in_scan) : spacing_mm;
  }
};

/// Sanitises, fits normals, decides the viewpoint, estimates the noise.
/// `file_viewpoint` is what the file's pose says. Errors: unreadable_input when fewer than 3 usable points remain.
[[nodiscard]] Result<Scan> prepare_scan(const PointCloud& raw, const std::optional<Eigen::Vector3d>& file_viewpoint,
                                        const ViewpointRequest& request, const ScanOptions& options,
                                        const Context& context);

/// An evenly spread subset with normals fitted over about `normal_radius_mm`, oriented as the scan's.
[[nodiscard]] PointCloud downsample(const Scan& scan, double spacing_mm, double normal_radius_mm,
                                    const Context& context);

}  // namespace asbuilt::scan
