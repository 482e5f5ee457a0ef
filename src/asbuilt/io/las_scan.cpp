// SPDX-License-Identifier: Apache-2.0
// LAS 1.0 to 1.4 (ASPRS): scaled integers behind a header that counts them. LAZ is the same, compressed by a codec that
// no library of the distribution has.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include "asbuilt/io/file_map.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scan_assembly.h"

namespace asbuilt::io {
namespace {

template <class T>
T little_at(std::string_view bytes, std::size_t at) {
  std::array<char, sizeof(T)> copy;
  std::memcpy(copy.data(), bytes.data() + at, sizeof(T));
  if constexpr (std::endian::native != std::endian::little) std::ranges::reverse(copy);
  return std::bit_cast<T>(copy);
}

constexpr std::size_t kHeaderOf12 = 227, kHeaderOf14 = 375;

/// Bytes of a record of each point format (0 to 10), and where its colour is; 0: it has none.
struct PointFormat {
  std::size_t size, colour;
};
constexpr std::array<PointFormat, 11> kFormats{
    {{20, 0}, {28, 0}, {26, 20}, {34, 28}, {57, 0}, {63, 28}, {30, 0}, {36, 30}, {38, 30}, {59, 0}, {67, 30}}};

struct Header {
  int minor = 0, format = 0;
  std::size_t first_point = 0, record_size = 0;
  std::uint64_t points = 0;
  Eigen::Vector3d scale, offset;
};

Result<Header> header_of(const Input& input) {
  const std::string_view content = input.content;
  if (content.size() < kHeaderOf12) {
    return input.error_at_byte(content.size(), "the file ends within its LAS header, it seems to be truncated");
  }
  Header header;
  const int major = content[24];
  header.minor = content[25];
  if (major != 1 || header.minor < 0 || header.minor > 4) {
    return input.error_at_byte(24,
                               fmt::format("the LAS file has version {}.{}, expected 1.0 to 1.4", major, header.minor));
  }
  if (header.minor == 4 && content.size() < kHeaderOf14) {
    return input.error_at_byte(content.size(), "the file ends within its LAS header, it seems to be truncated");
  }
  const unsigned format = static_cast<unsigned char>(content[104]);
  if ((format & 0xC0u) != 0) {
    return input.error(
        "is compressed (LAZ), which cannot be read here; unpack it with 'laszip -i FILE.laz -o FILE.las' (LAStools), "
        "or "
        "export it as LAS, E57 or PLY");
  }
  if (format >= kFormats.size()) {
    return input.error_at_byte(104, fmt::format("the points have format {}, expected 0 to 10", format));
  }
  header.format = static_cast<int>(format);
  header.first_point = little_at<std::uint32_t>(content, 96);
  header.record_size = little_at<std::uint16_t>(content, 105);
  if (header.record_size < kFormats[format].size) {
    return input.error_at_byte(105, fmt::format("a point has {} bytes, expected at least {} for format {}",
                                                header.record_size, kFormats[format].size, format));
  }
  header.points = little_at<std::uint32_t>(content, 107);
  if (header.minor == 4) header.points = std::max(header.points, little_at<std::uint64_t>(content, 247));
  for (int axis = 0; axis < 3; ++axis) {
    header.scale[axis] = little_at<double>(content, 131 + 8 * static_cast<std::size_t>(axis));
    header.offset[axis] = little_at<double>(content, 155 + 8 * static_cast<std::size_t>(axis));
  }
  if (!header.scale.allFinite() || !header.offset.allFinite() || (header.scale.array() == 0.0).any()) {
    return input.error_at_byte(131, "the scale or the offset of the coordinates makes no sense");
  }
  const std::size_t header_size = little_at<std::uint16_t>(content, 94);
  if (header.first_point < std::max(header_size, kHeaderOf12) || header.first_point > content.size()) {
    return input.error_at_byte(96, fmt::format("the points begin at byte {}, which is not behind the header and within "
                                               "the {} bytes of the file",
                                               header.first_point, content.size()));
  }
  return header;
}

/// What the records between header and points declare, in a sentence, when it cannot be.
std::optional<std::string> flaw_in_records(const Input& input, const Header& header) {
  const std::string_view content = input.content;
  const auto declared = little_at<std::uint32_t>(content, 100);
  std::size_t at = std::max<std::size_t>(little_at<std::uint16_t>(content, 94), kHeaderOf12);
  for (std::uint32_t i = 0; i < declared; ++i) {
    constexpr std::size_t kRecordHeader = 54;
    if (at > header.first_point || header.first_point - at < kRecordHeader ||
        header.first_point - at - kRecordHeader < little_at<std::uint16_t>(content, at + 20)) {
      return fmt::format(
          "The header declares {} records before the points, there is room for {}; the points were read "
          "all the same.",
          declared, i);
    }
    at += kRecordHeader + little_at<std::uint16_t>(content, at + 20);
  }
  return std::nullopt;
}

/// LAS colours have 16 bits, but many writers put 8-bit values there.
bool has_wide_colours(std::string_view points, const Header& header, std::size_t colour) {
  constexpr std::uint64_t kRowsBetweenReleases = 1 << 20;
  for (std::uint64_t i = 0; i < header.points; ++i) {
    if (i > 0 && i % kRowsBetweenReleases == 0) {
      const std::size_t piece = kRowsBetweenReleases * header.record_size;
      release_pages(points.substr(static_cast<std::size_t>(i) * header.record_size - piece, piece));
    }
    const std::size_t at = static_cast<std::size_t>(i) * header.record_size + colour;
    for (std::size_t c = 0; c < 3; ++c) {
      if (little_at<std::uint16_t>(points, at + 2 * c) > 255) return true;
    }
  }
  return false;
}

}  // namespace

Result<std::vector<ScanFile>> read_las_scan(const std::filesystem::path& path, const Input& input,
                                            const ReadOptions& options) {
  ASBUILT_TRY(header, header_of(input));
  const std::string_view points = input.content.substr(header.first_point);
  if (const std::uint64_t fit = points.size() / header.record_size; fit < header.points) {
    return input.error_at_byte(input.content.size(), fmt::format("the file ends after {} of {} points, it seems to be "
                                                                 "truncated",
                                                                 fit, header.points));
  }
  RawPoints raw;
  raw.count = static_cast<std::size_t>(header.points);
  raw.rows = points.substr(0, raw.count * header.record_size);
  raw.positions = values_by_row<Eigen::Vector3d>([&](std::size_t i) {
    const std::size_t at = i * header.record_size;
    const Eigen::Vector3d whole(little_at<std::int32_t>(points, at), little_at<std::int32_t>(points, at + 4),
                                little_at<std::int32_t>(points, at + 8));
    return Eigen::Vector3d(whole.cwiseProduct(header.scale) + header.offset);
  });
  raw.intensities = values_by_row<float>(
      [&](std::size_t i) { return static_cast<float>(little_at<std::uint16_t>(points, i * header.record_size + 12)); });
  const std::size_t colour = kFormats[static_cast<std::size_t>(header.format)].colour;
  const unsigned shift = colour != 0 && has_wide_colours(points, header, colour) ? 8 : 0;
  if (colour != 0) {
    raw.colours = values_by_row<Rgb>([&](std::size_t i) {
      Rgb rgb;
      for (std::size_t c = 0; c < 3; ++c) {
        const unsigned value = little_at<std::uint16_t>(points, i * header.record_size + colour + 2 * c);
        rgb[c] = static_cast<std::uint8_t>(value >> shift);
      }
      return rgb;
    });
  }
  ScanFile scan = assemble_scan(path, fmt::format("las 1.{}", header.minor), raw, options);
  if (options.unit == Unit::stated) {
    scan.notes.emplace_back(
        "LAS leaves the unit to the map it belongs to, so mm was taken; most LAS files are in metres, which "
        "--scan-unit m says.");
  }
  if (auto flaw = flaw_in_records(input, header)) scan.notes.push_back(std::move(*flaw));
  return std::vector<ScanFile>{std::move(scan)};
}

}  // namespace asbuilt::io
