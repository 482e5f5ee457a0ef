// SPDX-License-Identifier: Apache-2.0
#include <open3d/geometry/PointCloud.h>
#include <open3d/io/PointCloudIO.h>

#include <utility>

#include "peers.h"

namespace asbuilt::bench {

std::optional<PeerPoints> read_with_open3d(const std::string& path) {
  if (path.ends_with(".e57")) return std::nullopt;
  open3d::geometry::PointCloud cloud;
  if (!open3d::io::ReadPointCloud(path, cloud)) return std::nullopt;
  PeerPoints points;
  points.rows = std::move(cloud.points_);
  return points;
}

}  // namespace asbuilt::bench
