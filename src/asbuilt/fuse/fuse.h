// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/point_cloud.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"

namespace asbuilt::fuse {

using Colour = std::array<std::uint8_t, 3>;  ///< red, green, blue

/// One refined scan: its segment at full density, in the scan frame, with oriented normals.
struct PosedSegment {
  PointCloud segment_in_scan;
  Pose model_from_scan = Pose::Identity();
  double noise_sigma_mm = 0.0;          ///< 0: unknown
  double spacing_mm = 0.0;              ///< 0: measured
  int scan_index = 0;                   ///< index in result.json
  std::vector<Colour> colours = {};     ///< as the sensor saw it; empty or one a point
  std::vector<float> intensities = {};  ///< likewise
};

struct FuseOptions {
  double merge_distance_mm =
      0.0;  ///< samples closer than this merge; 0: from spacing and noise; paper mode: plain union
  double max_normal_angle_deg = 45.0;  ///< samples whose normals differ by more are of different faces and never merge
  bool drop_isolated = true;           ///< leave out groups of one or two points far from everything else
  bool paper_mode = false;             ///< the union, every point where its scan puts it

  [[nodiscard]] Result<void> validate() const;
};

template <class Visitor>
void for_each_field(FuseOptions& options, Visitor&& field) {
  field("merge_distance", options.merge_distance_mm, "samples closer than this merge, mm (0: from spacing and noise)");
  field("max_normal_angle_deg", options.max_normal_angle_deg, "samples whose normals differ by more never merge");
  field("drop_isolated", options.drop_isolated, "leave out single points far from all others");
}

/// The part as built, in the model frame.
struct Reconstruction {
  PointCloud cloud;
  std::vector<std::uint16_t> scan;     ///< the dominant scan of each point
  std::vector<std::uint16_t> support;  ///< number of scans that saw it
  std::vector<float> sigma_mm;         ///< standard error along the normal (of independent sensor noise; 0: unknown)
  /// Means of the samples that were merged, by precision; one a point if any scan has them, else empty. Points of scans
  /// without them are black, and have no intensity (NaN).
  std::vector<Colour> colours;
  std::vector<float> intensities;
  double merge_distance_mm = 0.0;  ///< as used
  std::size_t isolated_dropped = 0;
};

/// The union of all segments under their poses, in the model frame, thinned where scans overlap.
///
/// The scan with the finest spacing keeps its samples; a sample of a coarser one is absorbed when it lies within 0.75
/// of its own spacing of a sample that was kept and faces the same way. A kept sample moves along its normal only, to
/// the mean of the samples around it that differ by no more than noise explains, each weighted by 1 / sigma^2: where it
/// stands on the surface stays as measured, so edges are not rounded, and the two sides of a thin wall, whose normals
/// oppose, never meet. Normals are fitted anew, to the points of one face each, where noise and spacing are known.
///
/// Same bytes for any number of threads. Cost O(n log n). Errors: invalid_argument (options, normals missing, scan
/// index out of [0, 65535], non-finite values), not_possible (no points at all), cancelled.
[[nodiscard]] Result<Reconstruction> fuse(std::span<const PosedSegment> segments, const FuseOptions& options,
                                          const Context& context);

}  // namespace asbuilt::fuse
