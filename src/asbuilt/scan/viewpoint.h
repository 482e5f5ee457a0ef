// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

namespace asbuilt::scan {

/// Where the sensor stood, in the scan frame.
struct Viewpoint {
  enum class Kind { none, point, direction };
  Kind kind = Kind::none;
  Eigen::Vector3d value =
      Eigen::Vector3d::Zero();  ///< position in mm, or the unit direction in which parallel rays fly

  [[nodiscard]] bool known() const { return kind != Kind::none; }
  /// Unit vector from a surface point towards the sensor; zero when nothing is known.
  [[nodiscard]] Eigen::Vector3d towards_sensor(const Eigen::Vector3d& point_in_scan) const;
};

/// How the user states it: `automatic` is decided per scan (docs/scan.md, section 4).
struct ViewpointRequest {
  bool automatic = true;
  Viewpoint stated;
  bool may_be_origin = true;  ///< `automatic` tries the scan's origin
  bool may_be_sought = true;  ///< `automatic` asks the points, whose density must be the sensor's
};

/// Who says where the sensor stood.
enum class ViewpointSource { none, stated, file, origin, points };

/// Share of the points that, seen from `viewpoint`, hide behind others of the same scan by more than a few
/// `spacing_mm`. A scan looks single-layered from where it was taken (only edges spill over) and from nowhere else.
[[nodiscard]] double hidden_share(std::span<const Eigen::Vector3f> points, double spacing_mm,
                                  const Viewpoint& viewpoint);

/// Whether the sensor may have stood there: few points hide behind others (hidden_share), few are seen edge-on,
/// and the signed normals, where the file has them, face it. `normals` are fitted (sign free), `file_normals` may be
/// empty.
[[nodiscard]] bool agrees_with_depth_order(std::span<const Eigen::Vector3f> points,
                                           std::span<const Eigen::Vector3f> normals,
                                           std::span<const Eigen::Vector3f> file_normals, double spacing_mm,
                                           const Viewpoint& viewpoint);

}  // namespace asbuilt::scan
