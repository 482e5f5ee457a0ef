// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/cad_face_name.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "asbuilt/io/input.h"

namespace asbuilt::io {
namespace {

constexpr std::size_t kLongestName = 500, kLongestShown = 48;  // characters
constexpr std::string_view kReplacement = "\xEF\xBF\xBD";      // U+FFFD

/// Bytes of the UTF-8 character that a text begins with; 0 if it begins with none.
std::size_t character_size(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  const std::size_t size = first < 0x80   ? 1
                           : first < 0xC2 ? 0
                           : first < 0xE0 ? 2
                           : first < 0xF0 ? 3
                           : first < 0xF5 ? 4
                                          : 0;
  if (size == 0 || size > text.size()) return 0;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  // Overlong forms, surrogates, and what lies beyond Unicode.
  if ((first == 0xE0 && byte(1) < 0xA0) || (first == 0xED && byte(1) > 0x9F) || (first == 0xF0 && byte(1) < 0x90) ||
      (first == 0xF4 && byte(1) > 0x8F)) {
    return 0;
  }
  return size;
}

std::string shortened(std::string_view name) {
  std::size_t end = 0, count = 0;
  while (end < name.size() && count < kLongestShown) {
    end += std::max<std::size_t>(1, character_size(name.substr(end)));
    ++count;
  }
  return end < name.size() ? std::string(name.substr(0, end)) + "…" : std::string(name);
}

}  // namespace

std::string clean_cad_name(std::string_view text) {
  std::string name;
  std::size_t count = 0;
  while (!text.empty() && count < kLongestName) {
    const std::size_t size = character_size(text);
    const std::string_view here = text.substr(0, std::max<std::size_t>(size, 1));
    text.remove_prefix(here.size());
    ++count;
    // C1 controls and the marks that turn the direction of writing would spoil the line they stand in.
    const bool is_control = (size == 1 && (here[0] < ' ' && here[0] >= 0)) || here == "\x7F" ||
                            (size == 2 && here[0] == '\xC2' && static_cast<std::uint8_t>(here[1]) < 0xA0) ||
                            (size == 3 && here >= "\xE2\x80\xA8" && here <= "\xE2\x80\xAE") ||
                            (size == 3 && here >= "\xE2\x81\xA6" && here <= "\xE2\x81\xA9");
    if (size == 0) {
      name += kReplacement;
    } else if (is_control) {
      name += ' ';
    } else {
      name += here;
    }
  }
  const std::size_t first = name.find_first_not_of(' ');
  if (first == std::string::npos) return {};
  name = name.substr(first, name.find_last_not_of(' ') - first + 1);
  return lower_case(name) == "none" ? std::string() : name;
}

std::string face_label(int face, const CadFaceNames& names) {
  std::string label = fmt::format("face {}", face);
  if (face < 0 || static_cast<std::size_t>(face) >= names.size()) return label;
  const CadFaceName& known = names[static_cast<std::size_t>(face)];
  if (!known.name.empty()) label += fmt::format(" \"{}\"", shortened(known.name));
  if (!known.part.empty()) label += " of " + shortened(known.part);
  return label;
}

}  // namespace asbuilt::io
