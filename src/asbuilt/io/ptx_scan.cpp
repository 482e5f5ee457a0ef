// SPDX-License-Identifier: Apache-2.0
// PTX (Leica): one scan after the other, each with its grid, the place of the sensor and a matrix. The points are in
// the sensor's frame; the matrix, written for row vectors, places them among the other scans.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "asbuilt/io/lines.h"
#include "asbuilt/io/number.h"
#include "asbuilt/io/readers.h"
#include "asbuilt/io/scan_assembly.h"

namespace asbuilt::io {
namespace {

constexpr std::size_t kMostValues = 7;  // x y z intensity r g b

struct Header {
  std::uint64_t columns = 0, rows = 0;
  Eigen::Vector3d sensor = Eigen::Vector3d::Zero();
  Eigen::Matrix4d file_from_scan = Eigen::Matrix4d::Identity();
};

struct Points {
  std::vector<Eigen::Vector3d> positions;
  std::vector<float> intensities;
  std::vector<Rgb> colours;
};

class PtxReader {
 public:
  PtxReader(const std::filesystem::path& path, const Input& input, const ReadOptions& options)
      : path_(path), input_(input), options_(options), lines_(input.content) {}

  std::vector<Result<ScanFile>> read() {
    std::vector<Result<ScanFile>> scans;
    while (lines_.next_with_content()) {
      scans.push_back(read_scan());
      if (!scans.back()) break;  // where the next one begins can no longer be told
    }
    return scans;
  }

  [[nodiscard]] bool last_line_is_open() const { return !lines_.is_ended(); }

 private:
  [[nodiscard]] tl::unexpected<Error> error(std::string_view what) const {
    return input_.error_at_line(lines_.number(), what);
  }

  Result<ScanFile> read_scan() {
    ASBUILT_TRY(header, read_header());
    ASBUILT_TRY(points, read_points(header));
    RawPoints raw;
    raw.count = points.positions.size();
    raw.positions = values_in(points.positions);
    if (!points.intensities.empty()) raw.intensities = values_in(points.intensities);
    if (!points.colours.empty()) raw.colours = values_in(points.colours);
    ScanFile scan = assemble_scan(path_, "ptx", raw, options_);
    scan.grid = ScanGrid{header.rows, header.columns};
    place(header, scan);
    if (options_.unit == Unit::stated) {
      scan.notes.emplace_back(
          "PTX states no unit, so mm was taken; most programs write PTX in metres, which --scan-unit m says.");
    }
    return scan;
  }

  /// Numbers of the line, exactly so many. `what` names the line for the error.
  Result<std::array<double, 4>> numbers(std::size_t count, std::string_view what) {
    if (!lines_.next_with_content()) return error(fmt::format("the file ends before {}", what));
    return numbers_here(count, what);
  }

  Result<std::array<double, 4>> numbers_here(std::size_t count, std::string_view what) const {
    std::array<double, 4> values{};
    WordCursor words(lines_.line());
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view word = words.next();
      const auto number = parse_number(word);
      if (!number || !std::isfinite(*number)) {
        return error(fmt::format("found {}, expected {} numbers for {}", in_quotes(lines_.line()), count, what));
      }
      values[i] = *number;
    }
    if (!words.rest().empty()) {
      return error(fmt::format("found {}, expected {} numbers for {}", in_quotes(lines_.line()), count, what));
    }
    return values;
  }

  Result<std::uint64_t> count_here(std::string_view what) const {
    WordCursor words(lines_.line());
    const auto count = parse_count(words.next());
    if (!count || !words.rest().empty() || *count > 0xffffffffu) {
      return error(fmt::format("found {}, expected {}", in_quotes(lines_.line()), what));
    }
    return *count;
  }

  Result<Header> read_header() {
    Header header;
    ASBUILT_TRY(columns, count_here("the number of columns of a PTX scan"));
    header.columns = columns;
    if (!lines_.next_with_content()) return error("the file ends before the number of rows");
    ASBUILT_TRY(rows, count_here("the number of rows of a PTX scan"));
    header.rows = rows;
    ASBUILT_TRY(sensor, numbers(3, "the sensor's place"));
    header.sensor = {sensor[0], sensor[1], sensor[2]};
    for (const char* axis : {"the sensor's x axis", "the sensor's y axis", "the sensor's z axis"}) {
      ASBUILT_CHECK(numbers(3, axis));
    }
    for (int row = 0; row < 4; ++row) {
      ASBUILT_TRY(values, numbers(4, "a row of the matrix"));
      for (int column = 0; column < 4; ++column) {
        header.file_from_scan(column, row) = values[static_cast<std::size_t>(column)];
      }
    }
    return header;
  }

  Result<Points> read_points(const Header& header) {
    Points points;
    const std::uint64_t count = header.columns * header.rows;
    // A line of three numbers has at least six characters with its end.
    const std::uint64_t fit = (input_.content.size() - lines_.end() + 1) / 6;
    if (count > fit) {
      return error(fmt::format("{} x {} points are declared, the file is too small for them, it seems to be truncated",
                               header.columns, header.rows));
    }
    points.positions.reserve(static_cast<std::size_t>(count));
    std::size_t values_in_first = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!lines_.next_with_content()) {
        return error(fmt::format("the scan ends after {} of {} points, the file seems to be truncated", i, count));
      }
      ASBUILT_TRY(found, take_point(points));
      if (i == 0) values_in_first = found;
      if (found != values_in_first) {
        return error(fmt::format("the point has {} values, the first one has {}", found, values_in_first));
      }
    }
    return points;
  }

  /// Appends the point of the line; how many values it has.
  Result<std::size_t> take_point(Points& points) const {
    std::array<double, kMostValues> values{};
    WordCursor words(lines_.line());
    std::size_t found = 0;
    for (std::string_view word = words.next(); !word.empty(); word = words.next(), ++found) {
      const auto number = parse_number(word);
      if (!number) return error(fmt::format("found {}, expected a number", in_quotes(word)));
      if (found == kMostValues) return error("the point has more than 7 values, expected x y z intensity r g b");
      values[found] = *number;
    }
    if (found != 3 && found != 4 && found != 6 && found != 7) {
      return error(fmt::format("the point has {} values, expected x y z, intensity, r g b", found));
    }
    points.positions.emplace_back(values[0], values[1], values[2]);
    if (found == 4 || found == 7) points.intensities.push_back(static_cast<float>(values[3]));
    if (found >= 6) {
      Rgb rgb;
      for (std::size_t c = 0; c < 3; ++c) {
        const double value = values[found - 3 + c];
        rgb[c] = static_cast<std::uint8_t>(std::isfinite(value) ? std::clamp(value, 0.0, 255.0) : 0.0);
      }
      points.colours.push_back(rgb);
    }
    return found;
  }

  /// The sensor's place in the scan's own frame, whichever way the writer meant it: with the points in the sensor's
  /// frame this is the origin, with the points already registered (and an identity for the matrix) the place itself.
  void place(const Header& header, ScanFile& scan) const {
    const double mm_per_unit = millimetres_per(options_.unit);
    if (!is_rigid(header.file_from_scan, 1e-3)) {
      scan.notes.emplace_back("The matrix of the scan is not a rigid motion and was ignored.");
      return;
    }
    Pose pose;
    pose.matrix() = header.file_from_scan;
    pose = orthonormalised(pose);
    const bool says_something = !pose.matrix().isIdentity(1e-9) || !header.sensor.isZero(0.0);
    // Without a place the matrix alone says that the points are in the sensor's frame.
    const Eigen::Vector3d sensor_in_scan =
        header.sensor.isZero(0.0) ? Eigen::Vector3d::Zero() : Eigen::Vector3d(pose.inverse() * header.sensor);
    if (says_something) scan.viewpoint_mm = mm_per_unit * sensor_in_scan;
    pose.translation() *= mm_per_unit;
    scan.file_from_scan = pose;
  }

  const std::filesystem::path& path_;
  const Input& input_;
  const ReadOptions& options_;
  LineCursor lines_;
};

}  // namespace

bool is_ptx(std::string_view content) {
  LineCursor lines(content.substr(0, 2048));
  constexpr std::array<std::size_t, 10> kValues{1, 1, 3, 3, 3, 3, 4, 4, 4, 4};
  for (const std::size_t expected : kValues) {
    if (!lines.next_with_content()) return false;
    WordCursor words(lines.line());
    std::size_t found = 0;
    for (std::string_view word = words.next(); !word.empty(); word = words.next(), ++found) {
      if (!parse_number(word)) return false;
    }
    if (found != expected) return false;
  }
  return true;
}

Result<std::vector<ScanFile>> read_ptx_scans(const std::filesystem::path& path, const Input& input,
                                             const ReadOptions& options) {
  PtxReader reader(path, input, options);
  std::vector<Result<ScanFile>> read = reader.read();
  if (read.empty()) return input.error("the file holds nothing, expected PTX scans");
  ASBUILT_TRY(scans, readable_of(path, std::move(read)));
  if (reader.last_line_is_open()) {
    scans.back().notes.emplace_back("The last line has no line end: its last value may have been cut off.");
  }
  return std::move(scans);
}

}  // namespace asbuilt::io
