// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::bench {

/// What a part is to the suite. Truly symmetric parts are a group of their own: their pose is known only modulo the
/// motions that map them onto themselves.
enum class Group { distinct, symmetric };
[[nodiscard]] const char* name_of(Group group);

/// A part of the suite.
struct SuitePart {
  std::string name;
  Group group = Group::distinct;
  std::string family;          ///< parts of one family are decoys of one another
  bool is_own_mirror = false;  ///< its mirror image is the part itself in another pose, so no decoy
  TriangleMesh mesh;           ///< the CAD, in the model frame, mm
  /// Motions that map the part onto itself, the identity left out; continuous turns in steps of half a degree.
  std::vector<Pose> symmetries;
};

/// Parts made by code, always there.
[[nodiscard]] std::vector<SuitePart> own_parts();

/// Those of a folder of CAD files (bench/README.md lists them); a file that is absent is left out.
/// Errors: unreadable_input for one that is there but cannot be read.
[[nodiscard]] Result<std::vector<SuitePart>> parts_of(const std::filesystem::path& cad_folder);

}  // namespace asbuilt::bench
