// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace asbuilt::io {

/// What a CAD file calls a face, and in an assembly the part that it belongs to. UTF-8; empty where it says nothing.
struct CadFaceName {
  std::string name, part;

  bool operator==(const CadFaceName&) const = default;
};

/// By the number of the face; shorter than the faces, or empty, where none of the rest has a name.
using CadFaceNames = std::vector<CadFaceName>;

/// How a face is spoken of: `face 12`, `face 12 "bore A"`, `face 12 "bore A" of lid`. Long names are shortened.
[[nodiscard]] std::string face_label(int face, const CadFaceNames& names);

/// A name as CAD programs write it, made fit to be shown in one line: control characters become spaces, what is no UTF-8
/// becomes U+FFFD, blanks at both ends go, `NONE` and the like count as no name, and 500 characters are the longest.
[[nodiscard]] std::string clean_cad_name(std::string_view text);

}  // namespace asbuilt::io
