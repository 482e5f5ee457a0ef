// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

namespace asbuilt::test {

/// An 8-bit RGB picture.
struct Decoded {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;
  [[nodiscard]] const unsigned char* at(int x, int y) const { return rgb.data() + 3 * (y * width + x); }
};

/// Reads a PNG by the letter of the standard: chunk sums, one deflate stream, all five filters. Throws on what is
/// wrong.
inline Decoded decode_png(const std::string& png) {
  const auto need = [](bool fine, const char* what) {
    if (!fine) throw std::runtime_error(what);
  };
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(png.at(i)); };
  const auto word = [&](std::size_t i) {
    return (static_cast<std::uint32_t>(byte(i)) << 24) | (byte(i + 1) << 16) | (byte(i + 2) << 8) | byte(i + 3);
  };
  need(png.substr(0, 8) == "\x89PNG\r\n\x1a\n", "signature");
  Decoded image;
  std::string deflated;
  bool ended = false;
  for (std::size_t place = 8; place < png.size();) {
    const std::uint32_t length = word(place);
    const std::string type = png.substr(place + 4, 4);
    const auto* begin = reinterpret_cast<const unsigned char*>(png.data()) + place + 4;
    need(crc32(0, begin, length + 4) == word(place + 8 + length), "chunk sum");
    if (type == "IHDR") {
      image.width = static_cast<int>(word(place + 8));
      image.height = static_cast<int>(word(place + 12));
      need(byte(place + 16) == 8 && byte(place + 17) == 2 && byte(place + 20) == 0, "8-bit RGB, not interlaced");
    }
    if (type == "IDAT") deflated += png.substr(place + 8, length);
    ended = type == "IEND";
    place += 12 + length;
  }
  need(ended, "IEND last");
  const std::size_t stride = 3 * static_cast<std::size_t>(image.width);
  std::vector<unsigned char> raw((stride + 1) * static_cast<std::size_t>(image.height));
  auto size = static_cast<uLongf>(raw.size());
  need(uncompress(raw.data(), &size, reinterpret_cast<const Bytef*>(deflated.data()),
                  static_cast<uLong>(deflated.size())) == Z_OK,
       "deflate");
  need(size == raw.size(), "size of the data");
  std::vector<unsigned char> above(stride, 0), row(stride);
  for (int y = 0; y < image.height; ++y) {
    const unsigned char* line = raw.data() + static_cast<std::size_t>(y) * (stride + 1);
    for (std::size_t i = 0; i < stride; ++i) {
      const int a = i >= 3 ? row[i - 3] : 0, b = above[i], c = i >= 3 ? above[i - 3] : 0;
      const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
      const int paeth = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
      const int guess[] = {0, a, b, (a + b) / 2, paeth};
      need(line[0] <= 4, "filter");
      row[i] = static_cast<unsigned char>(line[1 + i] + guess[line[0]]);
    }
    image.rgb.insert(image.rgb.end(), row.begin(), row.end());
    above = row;
  }
  return image;
}

}  // namespace asbuilt::test
