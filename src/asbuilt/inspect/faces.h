// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/io/cad_face_name.h"
#include "asbuilt/inspect/spots.h"
#include "asbuilt/inspect/statistics.h"
#include "asbuilt/inspect/tolerance.h"
#include "asbuilt/inspect/verdict.h"

namespace asbuilt::inspect {

/// The skin cut into faces: those of the CAD, or, for a mere mesh, what lies between sharp edges.
struct FaceMap {
  std::vector<std::uint32_t> of_triangle;  ///< index of the face; one per triangle of the skin
  std::vector<int> cad_face;               ///< number in the CAD file; -1 for pieces of a mesh
  std::vector<std::string> names;          ///< "face 12", 'face 12 "bore A"', "piece 3", "small pieces"
};

/// Faces of a CAD model are called as `cad_names` has it.
/// Faces of a mesh are pieces between edges of more than 30 degrees, largest first; those below 0.5 % of the area are
/// taken together, as are all beyond the hundredth.
[[nodiscard]] FaceMap faces_of(const TriangleMesh& skin, const io::CadFaceNames& cad_names = {});

/// One face or box and what was measured on it.
struct SurfacePart {
  std::string name;
  int cad_face = -1;
  double area_mm2 = 0.0;
  std::size_t spots = 0, spots_scanned = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();  ///< means over its spots
  DeviationStatistics statistics;
  std::optional<Tolerance> tolerance;
  std::optional<Verdict> verdict;  ///< absent without a tolerance for it

  [[nodiscard]] double coverage() const {
    return spots > 0 ? static_cast<double>(spots_scanned) / static_cast<double>(spots) : 0.0;
  }
};

/// What is asked of a face before it passes.
struct VerdictRule {
  double required_share = 0.99;   ///< of what was scanned must be within tolerance
  double minimum_coverage = 0.5;  ///< less scanned is not enough data, unless what was scanned fails
};

/// not scanned, fail (less than the required share within tolerance), not enough data, pass; first that applies. Three
/// spots at least are needed to judge, and two of them out of tolerance to fail (one, if all must be within).
[[nodiscard]] Verdict verdict_of(const SurfacePart& part, const VerdictRule& rule);

/// The part fails if a face or box fails; else it is not scanned if nothing was, not enough data below the minimum
/// coverage, else it passes. Absent if nothing has a tolerance.
[[nodiscard]] std::optional<Verdict> verdict_of_all(std::span<const SurfacePart> faces,
                                                    std::span<const SurfacePart> boxes, double coverage,
                                                    const VerdictRule& rule);

}  // namespace asbuilt::inspect
