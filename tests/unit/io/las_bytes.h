// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "unit/io/bytes.h"

namespace asbuilt::test {

/// A LAS file of the points (offset + 0.01 x, -0.02 y, 5 + 0.001 z) with intensity 7 i, and colours (128, 1, 255) where
/// the point format has them; a record before the points, and bytes behind each point that no format knows.
inline std::string las(int format, int minor,
                       const std::vector<std::array<int, 3>>& raw = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}},
                       double offset = 100.0) {
  constexpr std::array<std::size_t, 11> kSizes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
  constexpr std::array<std::size_t, 11> kColours{0, 0, 20, 28, 0, 28, 0, 30, 30, 0, 30};
  const std::size_t header_size = minor == 4 ? 375 : 227, extra = 2;
  const std::size_t record = kSizes[static_cast<std::size_t>(format)] + extra;
  const std::string before = std::string(20, '\0') + little(std::uint16_t{3}) + std::string(32, '\0') + "abc";
  std::string header = "LASF" + std::string(20, '\0') + "\x01" + static_cast<char>(minor) + std::string(68, '\0');
  header += little(static_cast<std::uint16_t>(header_size));
  header += little(static_cast<std::uint32_t>(header_size + before.size())) + little(std::uint32_t{1});
  header += static_cast<char>(format) + little(static_cast<std::uint16_t>(record));
  header += little(static_cast<std::uint32_t>(minor == 4 ? 0 : raw.size())) + std::string(20, '\0');
  for (const double value : {0.01, -0.02, 0.001, offset, 0.0, 5.0}) header += little(value);
  header.resize(header_size, '\0');
  if (minor == 4) header.replace(247, 8, little(std::uint64_t{raw.size()}));
  std::string points;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    std::string point =
        little(raw[i][0]) + little(raw[i][1]) + little(raw[i][2]) + little(static_cast<std::uint16_t>(7 * i));
    point.resize(record, '\0');
    if (const std::size_t colour = kColours[static_cast<std::size_t>(format)]; colour != 0) {
      point.replace(colour, 6,
                    little(std::uint16_t{0x8000}) + little(std::uint16_t{0x0100}) + little(std::uint16_t{0xffff}));
    }
    points += point;
  }
  return header + before + points;
}

}  // namespace asbuilt::test
