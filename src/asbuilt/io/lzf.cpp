// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/io/lzf.h"

#include <algorithm>
#include <cstring>

namespace asbuilt::io {

// A stream is a row of runs. A control byte c below 32 announces c + 1 literal bytes. Otherwise its upper three bits
// are a length (7: the next byte adds to it), its lower five bits and one more byte a distance; length + 2 bytes are
// repeated from distance + 1 bytes back, and the two ranges may overlap.
std::optional<std::string> lzf_expand(std::string_view compressed, std::size_t size) {
  std::string expanded(size, '\0');
  std::size_t in = 0, out = 0;
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(compressed[at]); };
  while (in < compressed.size()) {
    const unsigned control = byte(in++);
    if (control < 32) {
      const std::size_t run = control + 1;
      if (compressed.size() - in < run || size - out < run) return std::nullopt;
      compressed.copy(expanded.data() + out, run, in);
      in += run;
      out += run;
      continue;
    }
    std::size_t length = control >> 5;
    if (length == 7) {
      if (in == compressed.size()) return std::nullopt;
      length += byte(in++);
    }
    length += 2;
    if (in == compressed.size()) return std::nullopt;
    const std::size_t distance = ((control & 31u) << 8 | byte(in++)) + 1;
    if (distance > out || size - out < length) return std::nullopt;
    // A copy of `distance` bytes never overlaps what it comes from.
    for (std::size_t left = length; left > 0;) {
      const std::size_t run = std::min(left, distance);
      std::memcpy(expanded.data() + out, expanded.data() + out - distance, run);
      out += run;
      left -= run;
    }
  }
  if (out != size) return std::nullopt;
  return expanded;
}

std::size_t lzf_largest_expansion(std::size_t compressed_size) {
  // Three bytes repeat at most 7 + 255 + 2 bytes.
  return (compressed_size / 3 + 1) * 264;
}

}  // namespace asbuilt::io
