// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/inspect/feet.h"
#include "asbuilt/inspect/measurement.h"
#include "asbuilt/model/prepared_model.h"

namespace asbuilt::inspect {

/// What was measured at one place of the CAD surface.
struct Spot {
  static constexpr std::uint16_t kNoScan = 65535;
  float deviation_mm = std::numeric_limits<float>::quiet_NaN();       ///< NaN where nothing was scanned
  float standard_error_mm = std::numeric_limits<float>::quiet_NaN();  ///< of the deviation; NaN where unknown
  std::uint32_t points = 0;                                           ///< that the deviation is a mean of
  std::uint16_t scans = 0;                                            ///< that see it
  std::uint16_t scan = kNoScan;                                       ///< that brought most of the points

  [[nodiscard]] bool is_scanned() const { return points > 0; }
};

/// A smooth extremum of the deviation near a place.
struct Peak {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double deviation_mm = 0.0, standard_error_mm = 0.0;
};

/// The points of a cloud by where they meet the surface: answers what was measured at any place of it.
class SpotFinder {
 public:
  /// `radius_mm`: points that meet the surface so near to a place speak for it (more where the cloud is coarser).
  /// Points further off the surface than `max_distance_mm`, and those whose own normal is turned against the face they
  /// meet, say nothing. `model_from_cloud` turns the cloud's normals. Keeps references to nothing but the poses.
  SpotFinder(const Measurement& measurement, const Pose& model_from_cloud, const Feet& feet,
             const model::PreparedModel& model, double radius_mm, double max_distance_mm, const Context& context);
  ~SpotFinder();
  SpotFinder(SpotFinder&&) noexcept;
  SpotFinder& operator=(SpotFinder&&) noexcept;

  /// One spot per place of the surface (position and outward normal), docs/inspect.md.
  ///
  /// A place was scanned if a point meets the surface within half a point spacing of it, or within one spacing if
  /// others lie around it on all sides; the spacing is that of the points about the place. So neither does a scan's rim
  /// reach further than half of what a point stands for, nor does a hole close. The deviation is the mean of the points
  /// about it without outliers. Its standard error: from their scatter and the stated noise, their number, and how well
  /// their scans' poses are known.
  [[nodiscard]] std::vector<Spot> at(const PointCloud& places, const Context& context) const;
  /// The same for pictures: from the nearest few dozen points only where there are many, so sharper and sooner there.
  [[nodiscard]] std::vector<Spot> detailed_at(const PointCloud& places, const Context& context) const;

  /// The extremum (towards `sign`) of the surface that the points about a place were measured on (extremum.h): a mean
  /// over the neighbourhood would level a narrow dent. `reach_mm` is how far it is looked for, and from how far around
  /// it points are taken. Falls back on the spot where there are too few points.
  [[nodiscard]] Peak peak_near(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, double sign,
                               double reach_mm, const Spot& spot) const;

  [[nodiscard]] double noise_sigma_mm() const;  ///< of single points, robust, from their scatter; 0: unknown
  [[nodiscard]] double spacing_mm() const;      ///< of the points, median; 0: fewer than two

 private:
  struct Implementation;
  std::unique_ptr<const Implementation> implementation_;
};

}  // namespace asbuilt::inspect
