// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/inspect/statistics.h"

namespace asbuilt::inspect {

/// A point of the part that was measured by other means: photogrammetry, a probe.
struct ReferencePoint {
  std::string name;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< in the model frame, mm
  std::optional<double> sigma_mm;                      ///< its standard error
};

/// Reads lines x,y,z or name,x,y,z, each with an optional sigma behind; x,y,z,sigma and name,x,y,z are told apart by
/// whether the first field is a number. A header may come first, # begins a comment, semicolons part fields as well.
/// `mm_per_unit` scales what is read. Errors: unreadable_input with the line.
[[nodiscard]] Result<std::vector<ReferencePoint>> read_reference_points(const std::filesystem::path& path,
                                                                        double mm_per_unit = 1.0);
[[nodiscard]] Result<std::vector<ReferencePoint>> reference_points_in(std::string_view content, const std::string& name,
                                                                      double mm_per_unit = 1.0);

/// How far the reconstruction is from one of them.
struct ReferenceDeviation {
  bool measured = false;            ///< false: the reconstruction has no surface there
  double deviation_mm = 0.0;        ///< of the reconstruction from the point; positive: it lies outside of it
  double distance_mm = 0.0;         ///< to the reconstruction's surface, without sign
  double standard_error_mm = 0.0;   ///< of the deviation, the point's own sigma included where known; 0: unknown
  std::optional<bool> significant;  ///< more than three standard errors
};

struct ReferenceReport {
  double search_distance_mm = 0.0;
  std::vector<ReferencePoint> points;
  std::vector<ReferenceDeviation> deviations;
  DeviationStatistics statistics;  ///< over the measured ones
};

/// The paper's way of judging a large part (Sec. 4): the distance of independent points to the reconstruction. A plane
/// is fitted to the reconstruction about each point; without a surface within `search_distance_mm` (0: 1 % of the
/// diameter) the point is not measured. `outward_normals` has one entry a point of the cloud, in the cloud's frame.
[[nodiscard]] ReferenceReport compared_with(const std::vector<ReferencePoint>& points, const PointCloud& cloud,
                                            std::span<const Eigen::Vector3f> outward_normals,
                                            const Pose& model_from_cloud, double diameter_mm, double noise_sigma_mm,
                                            double search_distance_mm);

}  // namespace asbuilt::inspect
