// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "unit/io/bytes.h"

namespace asbuilt::test {

/// CRC-32 of PNG and gzip, one bit after the other.
inline std::uint32_t plain_crc32(const std::string& bytes) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1) ^ ((crc & 1u) != 0 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

/// A deflate stream of one block that is merely stored (RFC 1951, 3.2.4): no compressor is needed to write it.
inline std::string stored(const std::string& content) {
  const auto size = static_cast<std::uint16_t>(content.size());
  return '\1' + little(size) + little(static_cast<std::uint16_t>(~size)) + content;
}

inline std::string gzipped(const std::string& content) {
  return std::string("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10) + stored(content) + little(plain_crc32(content)) +
         little(static_cast<std::uint32_t>(content.size()));
}

inline std::string png_chunk(const std::string& type, const std::string& content) {
  return big(static_cast<std::uint32_t>(content.size())) + type + content + big(plain_crc32(type + content));
}

/// Recomputes the checksum of every chunk of a PNG, as far as there are whole ones.
inline void repair_png_checksums(std::string& image) {
  for (std::size_t at = 8; at + 12 <= image.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(image[at + i]);
    if (length > image.size() - at - 12) return;
    image.replace(at + 8 + length, 4, big(plain_crc32(image.substr(at + 4, 4 + length))));
    at += 12 + length;
  }
}

/// A 16-bit grey PNG from its rows, each with its filter byte in front.
inline std::string png(std::uint32_t width, std::uint32_t height, const std::string& filtered_rows) {
  std::uint32_t a = 1, b = 0;
  for (const char c : filtered_rows) {
    a = (a + static_cast<unsigned char>(c)) % 65521;
    b = (b + a) % 65521;
  }
  const std::string zlib = "\x78\x01" + stored(filtered_rows) + big((b << 16) | a);
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", big(width) + big(height) + std::string("\x10\0\0\0\0", 5)) +
         png_chunk("tEXt", "a comment") + png_chunk("IDAT", zlib.substr(0, 5)) + png_chunk("IDAT", zlib.substr(5)) +
         png_chunk("IEND", "");
}

}  // namespace asbuilt::test
