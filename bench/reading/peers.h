// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace asbuilt::bench {

/// What a reader made of a file, as far as it shows that all points were read: their number and the sum of their
/// coordinates, in mm.
struct PointsRead {
  std::size_t count = 0;
  Eigen::Vector3d sum_mm = Eigen::Vector3d::Zero();
};

/// The points of a file in the peer's own structure; taken apart only after the clock has stopped.
struct PeerPoints {
  std::vector<Eigen::Vector3d> rows;
  std::vector<float> x, y, z;

  [[nodiscard]] PointsRead summed(double mm_per_unit) const {
    PointsRead read{rows.size() + x.size()};
    for (const Eigen::Vector3d& row : rows) read.sum_mm += mm_per_unit * row;
    for (std::size_t i = 0; i < x.size(); ++i)
      read.sum_mm += mm_per_unit * Eigen::Vector3f(x[i], y[i], z[i]).cast<double>();
    return read;
  }
};

/// Nothing where the peer was not there at build time or cannot read the file.
[[nodiscard]] std::optional<PeerPoints> read_with_open3d(const std::string& path);
[[nodiscard]] std::optional<PeerPoints> read_with_libe57(const std::string& path);

/// Writes points (mm) as scaled integers of a hundredth of a millimetre, as scanners' software packs them. False where
/// libE57Format was not there at build time.
[[nodiscard]] bool write_integers_with_libe57(const std::string& path, const std::vector<Eigen::Vector3f>& points_mm);

}  // namespace asbuilt::bench
