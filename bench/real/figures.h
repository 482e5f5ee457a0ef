// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::bench {

/// A finished `asbuilt reconstruct` on real scans, and where its truth is.
struct RealRun {
  std::filesystem::path result_dir;
  std::filesystem::path model;
  io::Unit unit = io::Unit::millimetre;  ///< of model, scans and reference poses alike
  /// A file, or a folder with NAME.txt per scan: 16 numbers, x_scan = M * x_model.
  std::filesystem::path reference;
};

struct PoseFigures {
  std::string scan, status, reason;
  bool accepted = false;
  double angle_deg = 0.0;        ///< between our rotation and the reference
  double centroid_mm = 0.0;      ///< displacement of the centroid of the model's surface
  double worst_vertex_mm = 0.0;  ///< displacement of the CAD vertex that moves most
  bool right = false;            ///< accepted, and worst_vertex_mm is at most 2 % of the diameter
};

struct RealFigures {
  double diameter_mm = 0.0;
  std::size_t given = 0, accepted = 0, right = 0, wrong = 0, components = 0;
  /// Mean exact distance of all finite points of the accepted scans to the model, nothing trimmed; of the same points
  /// under the reference poses beside it. Empty when no scan was accepted.
  std::optional<double> mean_distance_mm, reference_distance_mm;
  std::vector<PoseFigures> poses;
};

[[nodiscard]] Result<RealFigures> measure(const RealRun& run, const Context& context);

}  // namespace asbuilt::bench
