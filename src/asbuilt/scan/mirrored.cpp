// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/mirrored.h"

namespace asbuilt::scan {

Scan mirrored(Scan scan) {
  for (Eigen::Vector3f& position : scan.cloud.positions) position.x() = -position.x();
  for (Eigen::Vector3f& normal : scan.cloud.normals) normal.x() = -normal.x();
  scan.viewpoint.value.x() = -scan.viewpoint.value.x();
  scan.spacing_by_range = scan.spacing_by_range.mirrored();
  return scan;
}

}  // namespace asbuilt::scan
