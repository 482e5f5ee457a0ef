// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace asbuilt::io {

/// A string of a STEP file as UTF-8: the directives \X2\..\X0\, \X4\..\X0\, \X\hh and \S\c (ISO 10303-21, 6.4.3; of the
/// latter the alphabet ISO 8859-1) become the characters that they stand for, \\ a backslash. What is no whole directive
/// stays as it is.
[[nodiscard]] std::string decoded_step_text(std::string_view text);

}  // namespace asbuilt::io
