// SPDX-License-Identifier: Apache-2.0
// PNG (ISO 15948): signature, IHDR, one IDAT, IEND.
#include <zlib.h>

#include <array>
#include <cstdlib>
#include <span>
#include <vector>

#include "asbuilt/core/result.h"
#include "asbuilt/report/image.h"

namespace asbuilt::report {
namespace {

using Byte = unsigned char;
constexpr int kBytesPerPixel = 3;

void put_big_endian(std::string& text, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>((value >> shift) & 0xffU);
}

void put_chunk(std::string& png, std::string_view type, std::string_view data) {
  put_big_endian(png, static_cast<std::uint32_t>(data.size()));
  std::string body(type);
  body += data;
  png += body;
  const uLong sum = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  put_big_endian(png, static_cast<std::uint32_t>(sum));
}

Byte paeth(int left, int up, int up_left) {
  const int guess = left + up - up_left;
  const int by_left = std::abs(guess - left), by_up = std::abs(guess - up), by_corner = std::abs(guess - up_left);
  if (by_left <= by_up && by_left <= by_corner) return static_cast<Byte>(left);
  return static_cast<Byte>(by_up <= by_corner ? up : up_left);
}

/// The row under a filter of the standard: 1 differences to the left, 2 to above, 4 Paeth.
std::vector<Byte> filtered(std::span<const Byte> row, std::span<const Byte> above, int filter) {
  std::vector<Byte> result{static_cast<Byte>(filter)};
  for (std::size_t i = 0; i < row.size(); ++i) {
    const int left = i >= kBytesPerPixel ? row[i - kBytesPerPixel] : 0;
    const int up_left = i >= kBytesPerPixel ? above[i - kBytesPerPixel] : 0;
    const int guess = filter == 1 ? left : filter == 2 ? above[i] : paeth(left, above[i], up_left);
    result.push_back(static_cast<Byte>(row[i] - guess));
  }
  return result;
}

/// The filter whose differences are smallest, as the standard advises.
std::vector<Byte> best_filtered(std::span<const Byte> row, std::span<const Byte> above) {
  std::vector<Byte> best;
  long best_sum = 0;
  for (const int filter : {1, 2, 4}) {
    std::vector<Byte> candidate = filtered(row, above, filter);
    long sum = 0;
    for (std::size_t i = 1; i < candidate.size(); ++i)
      sum += std::abs(static_cast<int>(static_cast<signed char>(candidate[i])));
    if (!best.empty() && sum >= best_sum) continue;
    best = std::move(candidate);
    best_sum = sum;
  }
  return best;
}

std::string deflated(const std::vector<Byte>& data) {
  uLongf size = compressBound(static_cast<uLong>(data.size()));
  std::string result(size, '\0');
  const int code =
      compress2(reinterpret_cast<Bytef*>(result.data()), &size, data.data(), static_cast<uLong>(data.size()), 9);
  ASBUILT_EXPECT(code == Z_OK, "memory for a picture");
  result.resize(size);
  return result;
}

}  // namespace

std::string Image::png() const {
  std::string header;
  put_big_endian(header, static_cast<std::uint32_t>(width_));
  put_big_endian(header, static_cast<std::uint32_t>(height_));
  header += std::string("\x08\x02\x00\x00\x00", 5);  // 8 bits, RGB, deflate, adaptive filters, not interlaced

  const auto row_bytes = static_cast<std::size_t>(width_) * kBytesPerPixel;
  std::vector<Byte> data, above(row_bytes, 0), row(row_bytes);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Rgb pixel = at(x, y);
      for (std::size_t c = 0; c < 3; ++c) row[static_cast<std::size_t>(x) * kBytesPerPixel + c] = pixel[c];
    }
    const std::vector<Byte> line = best_filtered(row, above);
    data.insert(data.end(), line.begin(), line.end());
    above.swap(row);
  }
  std::string png("\x89PNG\r\n\x1a\n", 8);
  put_chunk(png, "IHDR", header);
  put_chunk(png, "IDAT", deflated(data));
  put_chunk(png, "IEND", {});
  return png;
}

}  // namespace asbuilt::report
