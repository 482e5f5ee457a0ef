// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/point_cloud.h"

namespace asbuilt::scan {

inline constexpr std::size_t kFaceNeighbours = 12;

/// When a point lies in the face of a neighbour.
struct InFace {
  double noise_sigma_mm = 0.0;
  double tilt = 0.0;   ///< error of a face normal to be reckoned with, radians: more room further away
  bool curved = true;  ///< ask the mean of both normals too: to it a chord of a circle is at right angles
};

/// Of the kFaceNeighbours nearest neighbours of each point `at`, how many have a face in which the point lies, within
/// 3 sigma. A point of a surface, be it at a rim, at an edge or on a narrow wall, has several; a mixed measurement
/// that floats between two surfaces has hardly any. `faces` has a normal a point of the cloud (face_normals.h) and
/// `tree` is over its positions. The same for any number of threads.
[[nodiscard]] std::vector<std::uint8_t> face_support(std::span<const std::uint32_t> at, const PointCloud& cloud,
                                                     std::span<const Eigen::Vector3f> faces, const KdTree& tree,
                                                     const InFace& rule, const Context& context);

}  // namespace asbuilt::scan
