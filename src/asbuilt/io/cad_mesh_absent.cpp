// SPDX-License-Identifier: Apache-2.0
// What stands in for cad_mesh.cpp in a build without OpenCASCADE.
#include <fmt/format.h>

#include "asbuilt/io/cad_mesh.h"

namespace asbuilt::io {

bool reads_cad() { return false; }

Result<ModelFile> read_cad(const std::filesystem::path&, FileKind kind, const Input& input, const ModelReadOptions&) {
  return input.error(fmt::format(
      "is a {} file, which this build of asbuilt cannot read; build it with OpenCASCADE (Debian: "
      "libocct-data-exchange-dev, then -DASBUILT_WITH_OPENCASCADE=ON), or export the part as STL, OBJ or PLY",
      name_of(kind) == "step"   ? "STEP"
      : name_of(kind) == "iges" ? "IGES"
                                : "BREP"));
}

}  // namespace asbuilt::io
