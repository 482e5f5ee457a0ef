// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/io/unit.h"

namespace asbuilt::evaluate {

/// Where the part stands in a scan.
struct TruePlacement {
  Pose model_from_scan = Pose::Identity();
  std::uint8_t label = 1;  ///< of its points
  double occlusion = 0.0, hidden = 0.0;
};

/// What is known about one scan. Paths are as in the file, relative to its folder.
struct TrueScan {
  std::filesystem::path path;
  std::filesystem::path labels;         ///< empty if there are none
  std::optional<Pose> model_from_scan;  ///< empty: the part is not there
  double occlusion = 0.0, hidden = 0.0, clutter = 0.0;
  std::vector<TruePlacement> other_placements;  ///< further ones of the same body; optional in the file

  [[nodiscard]] std::vector<TruePlacement> placements() const;  ///< all of them, the first one first
};

/// truth.json, schema 1 (docs/simulate.md).
struct Truth {
  std::filesystem::path folder;
  std::filesystem::path model, as_built;
  double noise_sigma_mm = 0.0;
  std::vector<TrueScan> scans;
  std::vector<Pose> symmetries;  ///< motions that map the part onto itself; optional in the file
};

/// Reads truth.json, or the one in a folder. Errors: unreadable_input naming the file and the field.
[[nodiscard]] Result<Truth> read_truth(const std::filesystem::path& path);

/// The points of a scan and their labels, one byte each. Errors: unreadable_input, also if their numbers differ.
struct LabelledPoints {
  std::vector<Eigen::Vector3d> points_in_scan;
  std::vector<std::uint8_t> labels;
};
[[nodiscard]] Result<LabelledPoints> read_labelled_points(const Truth& truth, const TrueScan& scan);

/// A reference pose from a text file of 16 numbers M, row by row, with x_scan = M * x_model, lengths in `unit`; given
/// back as model_from_scan in mm. Errors: unreadable_input.
[[nodiscard]] Result<Pose> read_reference_pose(const std::filesystem::path& path, io::Unit unit);

}  // namespace asbuilt::evaluate
