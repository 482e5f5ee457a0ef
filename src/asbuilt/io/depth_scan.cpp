// SPDX-License-Identifier: Apache-2.0
// Depth images: 16-bit grey PNG (W3C PNG, second edition), with a pinhole camera. Depth is measured along the optical
// axis; the camera stands at the origin, looks along +z, and y points down.
#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <span>

#include "asbuilt/io/file.h"
#include "asbuilt/io/gzip.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scan_assembly.h"

namespace asbuilt::io {
namespace {

struct Image {
  std::size_t width = 0, height = 0;
  std::vector<std::uint16_t> values;  // row by row
};

std::uint32_t big_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = (value << 8) | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

struct Chunks {
  std::string_view header;
  std::string data;  // all IDAT chunks, one after the other
};

Result<Chunks> read_chunks(const Input& input) {
  const std::string_view content = input.content;
  if (!content.starts_with("\x89PNG\r\n\x1a\n")) return input.error("is no PNG image");
  Chunks chunks;
  std::size_t at = 8;
  while (true) {
    if (content.size() - at < 12) return input.error_at_byte(at, "the image ends too early, it seems to be truncated");
    const std::size_t length = big_at(content, at);
    if (length > content.size() - at - 12) {
      return input.error_at_byte(at, "the image ends within a chunk, it seems to be truncated");
    }
    const std::string_view named = content.substr(at + 4, 4 + length), type = named.substr(0, 4);
    const auto checksum = ::crc32(0, reinterpret_cast<const Bytef*>(named.data()), static_cast<uInt>(named.size()));
    if (checksum != big_at(content, at + 8 + length)) {
      return input.error_at_byte(at, "a chunk of the image is damaged: its checksum does not match");
    }
    if (type == "IHDR") chunks.header = named.substr(4);
    if (type == "IDAT") chunks.data += named.substr(4);
    at += 12 + length;
    if (type == "IEND") break;
  }
  if (chunks.header.size() != 13) return input.error("the image has no header");
  return chunks;
}

/// Undoes the filter of a row, in place (PNG, section 9.2). Two bytes a pixel.
bool unfilter(int filter, std::span<unsigned char> row, std::span<const unsigned char> above) {
  constexpr std::size_t kPixel = 2;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const int left = i >= kPixel ? row[i - kPixel] : 0, up = above[i], corner = i >= kPixel ? above[i - kPixel] : 0;
    int predicted = 0;
    switch (filter) {
      case 0:
        break;
      case 1:
        predicted = left;
        break;
      case 2:
        predicted = up;
        break;
      case 3:
        predicted = (left + up) / 2;
        break;
      case 4: {
        const int estimate = left + up - corner;
        const int to_left = std::abs(estimate - left), to_up = std::abs(estimate - up),
                  to_corner = std::abs(estimate - corner);
        predicted = to_left <= to_up && to_left <= to_corner ? left : to_up <= to_corner ? up : corner;
        break;
      }
      default:
        return false;
    }
    row[i] = static_cast<unsigned char>(row[i] + predicted);
  }
  return true;
}

Result<Image> read_image(const Input& input) {
  ASBUILT_TRY(chunks, read_chunks(input));
  Image image;
  image.width = big_at(chunks.header, 0);
  image.height = big_at(chunks.header, 4);
  const int depth = chunks.header[8], colour = chunks.header[9], interlace = chunks.header[12];
  if (depth != 16 || colour != 0) {
    return input.error(
        fmt::format("is a PNG image of {} bits and colour type {}; a depth image has 16 bits of grey", depth, colour));
  }
  if (interlace != 0) return input.error("is an interlaced PNG image, save it without interlacing");
  const std::size_t row_size = 2 * image.width + 1;
  if (image.width == 0 || image.height == 0 || image.height > largest_expansion(chunks.data.size()) / row_size) {
    return input.error(
        fmt::format("an image of {} x {} pixels is declared, the file is too small for it", image.width, image.height));
  }
  ASBUILT_TRY(bytes, inflate_to(input, chunks.data, row_size * image.height));
  std::vector<unsigned char> above(row_size - 1, 0);
  image.values.reserve(image.width * image.height);
  for (std::size_t y = 0; y < image.height; ++y) {
    auto* const begin = reinterpret_cast<unsigned char*>(bytes.data()) + y * row_size;
    const std::span row(begin + 1, row_size - 1);
    if (!unfilter(*begin, row, above)) return input.error(fmt::format("row {} of the image is damaged", y));
    for (std::size_t x = 0; x < image.width; ++x) {
      image.values.push_back(static_cast<std::uint16_t>((row[2 * x] << 8) | row[2 * x + 1]));
    }
    std::ranges::copy(row, above.begin());
  }
  return image;
}

/// fx, fy, cx, cy in pixels; depth values are `steps` to the unit of the file.
struct Camera {
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0, steps = 1.0;
};

/// All numbers of a text, whatever stands between them; brackets and commas of JSON too.
std::vector<double> numbers_in(std::string_view text) {
  std::vector<double> numbers;
  constexpr std::string_view kBetween = " \t\r\n,;[](){}:\"";
  std::size_t at = 0;
  while ((at = text.find_first_not_of(kBetween, at)) != std::string_view::npos) {
    const std::size_t end = std::min(text.find_first_of(kBetween, at), text.size());
    if (const auto number = parse_number(text.substr(at, end - at))) numbers.push_back(*number);
    at = end;
  }
  return numbers;
}

/// fx fy cx cy, with the steps behind them, or a 3 x 3 matrix by rows or (as Open3D writes it) by columns.
std::optional<Camera> camera_from(std::string_view text) {
  const std::size_t matrix = text.find("intrinsic_matrix");
  const std::vector<double> n = numbers_in(matrix == std::string_view::npos ? text : text.substr(matrix + 16));
  Camera camera;
  if (n.size() == 4 || n.size() == 5) {
    camera = {n[0], n[1], n[2], n[3], n.size() == 5 ? n[4] : 1.0};
  } else if (n.size() >= 9 && n[8] == 1.0) {
    const bool by_columns = n[2] == 0.0 && n[5] == 0.0;
    camera = {n[0], n[4], by_columns ? n[6] : n[2], by_columns ? n[7] : n[5], 1.0};
  } else {
    return std::nullopt;
  }
  const bool makes_sense = camera.fx > 0.0 && camera.fy > 0.0 && camera.steps > 0.0 && std::isfinite(camera.fx) &&
                           std::isfinite(camera.fy) && std::isfinite(camera.cx) && std::isfinite(camera.cy) &&
                           std::isfinite(camera.steps);
  return makes_sense ? std::optional(camera) : std::nullopt;
}

Result<Camera> camera_of(const std::filesystem::path& path, const Input& input, const std::string& stated,
                         std::string& source) {
  constexpr std::string_view kExpected = "expected fx,fy,cx,cy in pixels, or a 3 x 3 matrix";
  std::error_code ignored;
  if (!stated.empty() && !std::filesystem::is_regular_file(stated, ignored)) {
    if (const auto camera = camera_from(stated)) return *camera;
    return fail(ErrorCode::invalid_argument,
                fmt::format("--camera {}: {}, or a file with one of them", in_quotes(stated), kExpected));
  }
  std::vector<std::filesystem::path> candidates;
  if (!stated.empty()) candidates.emplace_back(stated);
  const std::filesystem::path folder = path.parent_path();
  for (const auto& place : {folder, folder / ".."}) {
    for (const char* name : {"intrinsic.txt", "intrinsics.txt", "camera.txt", "camera_intrinsic.json"}) {
      if (stated.empty()) candidates.push_back(place / name);
    }
  }
  for (const auto& file : candidates) {
    if (!std::filesystem::is_regular_file(file, ignored)) continue;
    ASBUILT_TRY(text, read_file(file));
    source = file.lexically_normal().string();
    if (const auto camera = camera_from(text)) return *camera;
    return input.error(fmt::format("the camera's file {} is not understood, {}", in_quotes(source), kExpected));
  }
  return input.error(
      "is a depth image without a camera: say --camera fx,fy,cx,cy (pixels), or put it into intrinsic.txt beside it");
}

}  // namespace

Result<std::vector<ScanFile>> read_depth_scan(const std::filesystem::path& path, const Input& input,
                                              const ReadOptions& options) {
  ASBUILT_TRY(image, read_image(input));
  std::string source;
  ASBUILT_TRY(camera, camera_of(path, input, options.camera, source));
  RawPoints points;
  points.count = image.values.size();
  points.positions = values_by_row<Eigen::Vector3d>([&](std::size_t i) {
    const double depth = image.values[i] / camera.steps;
    const auto x = static_cast<double>(i % image.width), y = static_cast<double>(i / image.width);
    return Eigen::Vector3d((x - camera.cx) / camera.fx * depth, (y - camera.cy) / camera.fy * depth, depth);
  });
  ScanFile scan = assemble_scan(path, "png depth", points, options);
  scan.viewpoint_mm = Eigen::Vector3d::Zero();
  scan.grid = ScanGrid{image.height, image.width};
  scan.notes.push_back(fmt::format("A depth image of {} x {} pixels, camera fx {:g}, fy {:g}, cx {:g}, cy {:g}{}.",
                                   image.width, image.height, camera.fx, camera.fy, camera.cx, camera.cy,
                                   source.empty() ? "" : " from " + source));
  return std::vector<ScanFile>{std::move(scan)};
}

}  // namespace asbuilt::io
