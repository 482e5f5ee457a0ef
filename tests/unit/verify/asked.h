// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "asbuilt/verify/evidence.h"
#include "asbuilt/verify/verify.h"
#include "unit/verify/seen.h"

namespace asbuilt::test {

inline const Eigen::Vector3d kBrick(100, 80, 60);  // mm
inline const verify::VerifyOptions kLimits;

/// A scene that was seen from the origin, asked about a part at a pose.
struct Asked {
  Asked(model::PreparedModel part, const Pose& believed_model_from_scan, const std::vector<TriangleMesh>& scene,
        double half_width)
      : model(std::move(part)), model_from_scan(believed_model_from_scan), scan(seen(scene, half_width)) {
    const double distance_mm = 0.5 * scan.spacing_mm + 0.005 * model.diameter;
    options = {distance_mm, std::max(distance_mm, 2.5 * scan.spacing_mm)};
    seen_by = std::make_unique<verify::ScanEvidence>(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
    evidence = verify::evidence_for(model_from_scan, model.dense_samples, model, *seen_by, options);
  }

  model::PreparedModel model;
  Pose model_from_scan;
  scan::Scan scan;
  verify::EvidenceOptions options;
  std::unique_ptr<verify::ScanEvidence> seen_by;
  verify::PoseEvidence evidence;
};

/// The others, and a part among them.
inline std::vector<TriangleMesh> with(std::vector<TriangleMesh> others, const TriangleMesh& part,
                                      const Pose& scan_from_model) {
  others.push_back(simulate::transformed(part, scan_from_model));
  return others;
}

}  // namespace asbuilt::test
