// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asbuilt/core/result.h"

namespace asbuilt::inspect {

/// Deviations that the drawing allows, both ends included.
struct Tolerance {
  double low_mm = 0.0, high_mm = 0.0;

  [[nodiscard]] bool holds(double deviation_mm) const { return low_mm <= deviation_mm && deviation_mm <= high_mm; }
};

/// One row of a tolerance file: what holds for one CAD face, given by number or name, or in one box.
struct ToleranceRow {
  std::string name;                        ///< as the file has it; of a face "face N" if it has none
  std::optional<int> face;                 ///< number of the CAD face, from 0
  std::optional<Eigen::AlignedBox3d> box;  ///< in the model frame, mm
  Tolerance tolerance;
  std::size_t place = 0;      ///< line of the file, from 1
  std::string face_name = {};  ///< of the CAD face, where the row gives it in place of the number
};

/// What a tolerance file says.
struct ToleranceTable {
  std::optional<Tolerance> others;  ///< of every face that no row names
  std::vector<ToleranceRow> rows;
  std::string source = {};  ///< name of the file, for messages
};

/// Reads a tolerance file; JSON if its first character is { or [, else CSV (docs/inspect.md).
///
/// CSV: lines FACE,LOW,HIGH (FACE: a number, "face N", the name that the CAD file
/// gives the face, or * for all others) and NAME,LOW,HIGH,X1,Y1,Z1,X2,Y2,Z2 for a
/// box between two corners; semicolons part fields as well; # begins a comment; a header may come first.
/// JSON: {"default": [LOW, HIGH], "rows": [{"face": N or "NAME", "low": .., "high": ..}, {"name": "rim", "box": [[X1, Y1, Z1],
/// [X2, Y2, Z2]], "low": .., "high": ..}]}.
/// Errors: unreadable_input naming file, line, what was found and what was expected.
[[nodiscard]] Result<ToleranceTable> read_tolerances(const std::filesystem::path& path);
[[nodiscard]] Result<ToleranceTable> tolerances_in(std::string_view content, const std::string& name);

}  // namespace asbuilt::inspect
