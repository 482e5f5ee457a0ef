// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/segment_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "asbuilt/io/ply_writer.h"

namespace asbuilt::pipeline {
namespace {

constexpr const char *kDetected = "part_detected", *kBesideOccluder = "beside_occluder";

/// One coordinate of all vectors, moved by `shift`.
template <class Scalar>
std::vector<Scalar> column(const std::vector<Eigen::Vector3f>& vectors, Eigen::Index axis, double shift = 0.0) {
  std::vector<Scalar> values(vectors.size());
  std::ranges::transform(vectors, values.begin(), [&](const Eigen::Vector3f& v) {
    return static_cast<Scalar>(static_cast<double>(v[axis]) + shift);
  });
  return values;
}

Eigen::Vector3f turned_outwards(const Eigen::Vector3f& normal_in_scan, const Eigen::Vector3f& point_in_scan,
                                const Pose& model_from_scan, const model::PreparedModel& model) {
  const auto nearest = model.surface->nearest(model_from_scan * point_in_scan.cast<double>());
  const Eigen::Vector3d outwards = doubled_area_vector(model.skin, nearest.triangle);
  const bool agrees = (model_from_scan.linear() * normal_in_scan.cast<double>()).dot(outwards) >= 0.0;
  return agrees ? normal_in_scan : Eigen::Vector3f(-normal_in_scan);
}

}  // namespace

Segment cut_out(const scan::Scan& scan, const io::ScanFile& file, const verify::Detection& detection,
                const model::PreparedModel& model, const scan::Occluders& occluders, const Context& context) {
  std::vector<std::uint32_t> indices;
  std::ranges::merge(detection.segment, detection.margin_points, std::back_inserter(indices));
  Segment segment;
  for (const std::uint32_t i : indices) {
    const Eigen::Vector3f& position = scan.cloud.positions[i];
    const Eigen::Vector3f& normal = scan.cloud.normals[i];
    segment.cloud.positions.push_back(position);
    segment.cloud.normals.push_back(
        scan.normals_oriented ? normal : turned_outwards(normal, position, detection.best.model_from_scan, model));
    if (!file.colours.empty()) segment.colours.push_back(file.colours[scan.source_index[i]]);
    if (!file.intensities.empty()) segment.intensities.push_back(file.intensities[scan.source_index[i]]);
    segment.is_part.push_back(std::ranges::binary_search(detection.segment, i) ? 1 : 0);
  }
  segment.beside_occluder = occluders.beside(segment.cloud, context);
  return segment;
}

Result<void> write_segment(const std::filesystem::path& path, const Segment& segment,
                           const Eigen::Vector3d& offset_mm) {
  const auto& [positions, normals] = segment.cloud;
  std::array<std::vector<float>, 3> normal_columns{column<float>(normals, 0), column<float>(normals, 1),
                                                   column<float>(normals, 2)};
  std::array<std::vector<double>, 3> exact;
  std::array<std::vector<float>, 3> plain;
  std::vector<io::PlyColumn> columns;
  constexpr std::array<const char*, 3> kPositionNames{"x", "y", "z"}, kNormalNames{"nx", "ny", "nz"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    if (offset_mm.isZero(0.0)) {
      plain[axis] = column<float>(positions, a);
      columns.push_back({kPositionNames[axis], std::span<const float>(plain[axis])});
    } else {
      exact[axis] = column<double>(positions, a, offset_mm[a]);
      columns.push_back({kPositionNames[axis], std::span<const double>(exact[axis])});
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    columns.push_back({kNormalNames[axis], std::span<const float>(normal_columns[axis])});
  }
  columns.push_back({"part", std::span<const std::uint8_t>(segment.is_part)});
  if (!segment.was_part_detected.empty()) {
    columns.push_back({kDetected, std::span<const std::uint8_t>(segment.was_part_detected)});
  }
  if (!segment.beside_occluder.empty()) {
    columns.push_back({kBesideOccluder, std::span<const std::uint8_t>(segment.beside_occluder)});
  }
  std::array<std::vector<std::uint8_t>, 3> channels;
  constexpr std::array<const char*, 3> kChannelNames{"red", "green", "blue"};
  for (std::size_t c = 0; c < 3 && !segment.colours.empty(); ++c) {
    for (const io::Rgb& rgb : segment.colours) channels[c].push_back(rgb[c]);
    columns.push_back({kChannelNames[c], std::span<const std::uint8_t>(channels[c])});
  }
  if (!segment.intensities.empty()) {
    columns.push_back({"intensity", std::span<const float>(segment.intensities)});
  }
  const std::vector<std::string> comments{"asbuilt segment: scan frame, mm; part 1, margin 0"};
  return io::write_ply(path, columns, comments);
}

Result<Segment> read_segment(const std::filesystem::path& path, const Eigen::Vector3d& offset_mm) {
  ASBUILT_TRY(vertices, io::read_ply_vertices(path));
  std::array<const std::vector<double>*, 7> columns{};
  constexpr std::array<const char*, 7> kNames{"x", "y", "z", "nx", "ny", "nz", "part"};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    columns[i] = vertices.find(kNames[i]);
    if (columns[i] != nullptr) continue;
    return fail(ErrorCode::unreadable_input, fmt::format("{}: has no column '{}', expected a segment as asbuilt detect "
                                                         "writes it",
                                                         path.string(), kNames[i]));
  }
  Segment segment;
  const std::size_t points = columns[6]->size();
  for (std::size_t i = 0; i < points; ++i) {
    const Eigen::Vector3d position((*columns[0])[i], (*columns[1])[i], (*columns[2])[i]);
    const Eigen::Vector3d normal((*columns[3])[i], (*columns[4])[i], (*columns[5])[i]);
    segment.cloud.positions.emplace_back((position - offset_mm).cast<float>());
    segment.cloud.normals.emplace_back(normal.cast<float>());
    segment.is_part.push_back((*columns[6])[i] != 0.0 ? 1 : 0);
  }
  const auto read_flags = [&](const char* name, std::vector<std::uint8_t>& flags) {
    const std::vector<double>* values = vertices.find(name);
    if (values == nullptr) return;
    for (const double value : *values) flags.push_back(value != 0.0 ? 1 : 0);
  };
  read_flags(kDetected, segment.was_part_detected);
  read_flags(kBesideOccluder, segment.beside_occluder);
  const auto *red = vertices.find("red"), *green = vertices.find("green"), *blue = vertices.find("blue");
  if (red != nullptr && green != nullptr && blue != nullptr) {
    const auto channel = [](double value) { return static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0)); };
    for (std::size_t i = 0; i < points; ++i) {
      segment.colours.push_back({channel((*red)[i]), channel((*green)[i]), channel((*blue)[i])});
    }
  }
  if (const auto* intensity = vertices.find("intensity")) {
    for (const double value : *intensity) segment.intensities.push_back(static_cast<float>(value));
  }
  return segment;
}

Result<DetectedPart> read_part(const std::filesystem::path& path, const Eigen::Vector3d& offset_mm) {
  ASBUILT_TRY(segment, read_segment(path, offset_mm));
  const std::vector<std::uint8_t>& is_part =
      segment.was_part_detected.empty() ? segment.is_part : segment.was_part_detected;
  DetectedPart part;
  for (std::size_t i = 0; i < is_part.size(); ++i) {
    if (is_part[i] == 0) continue;
    part.cloud.positions.push_back(segment.cloud.positions[i]);
    part.cloud.normals.push_back(segment.cloud.normals[i]);
    if (!segment.beside_occluder.empty()) part.beside_occluder.push_back(segment.beside_occluder[i]);
  }
  return part;
}

}  // namespace asbuilt::pipeline
