// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/export_run.h"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "asbuilt/io/e57_writer.h"
#include "asbuilt/io/input.h"
#include "asbuilt/io/ply_writer.h"
#include "asbuilt/io/pose_file.h"

namespace asbuilt::pipeline {
namespace {

using Column = const std::vector<double>*;

/// Three columns, or none where one is missing.
std::vector<Column> columns_named(const io::PlyVertices& vertices, const std::array<const char*, 3>& names) {
  std::vector<Column> columns;
  for (const char* name : names) {
    if (const Column column = vertices.find(name)) columns.push_back(column);
  }
  if (columns.size() != 3) columns.clear();
  return columns;
}

/// The part's points out of a segment file, margin left out.
Result<io::E57Scan> scan_from_segment(const std::filesystem::path& path) {
  ASBUILT_TRY(vertices, io::read_ply_vertices(path));
  const auto position = columns_named(vertices, {"x", "y", "z"}), normal = columns_named(vertices, {"nx", "ny", "nz"}),
             colour = columns_named(vertices, {"red", "green", "blue"});
  const Column part = vertices.find("part"), intensity = vertices.find("intensity");
  if (position.empty() || part == nullptr) {
    return fail(ErrorCode::unreadable_input,
                fmt::format("{}: is no segment as asbuilt detect writes it", path.string()));
  }
  io::E57Scan scan;
  for (std::size_t i = 0; i < part->size(); ++i) {
    if ((*part)[i] == 0.0) continue;
    scan.positions_mm.emplace_back((*position[0])[i], (*position[1])[i], (*position[2])[i]);
    if (!normal.empty()) {
      scan.normals.push_back(Eigen::Vector3d((*normal[0])[i], (*normal[1])[i], (*normal[2])[i]).cast<float>());
    }
    if (!colour.empty()) {
      const auto byte = [&](std::size_t c) { return static_cast<std::uint8_t>((*colour[c])[i]); };
      scan.colours.push_back({byte(0), byte(1), byte(2)});
    }
    if (intensity != nullptr) scan.intensities.push_back(static_cast<float>((*intensity)[i]));
  }
  return scan;
}

}  // namespace

Result<std::size_t> export_run(const std::filesystem::path& folder, const io::RunRecord& record,
                               const std::filesystem::path& output) {
  const std::string extension = io::lower_case(output.extension().string());
  if (extension != ".csv" && extension != ".e57") {
    return fail(
        ErrorCode::invalid_argument,
        fmt::format("{}: expected a name that ends in .csv (poses) or .e57 (scans with poses)", output.string()));
  }
  std::vector<io::NamedPose> poses;
  std::vector<io::E57Scan> scans;
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const io::ScanRecord& scan = record.scans[i];
    if (scan.status != io::ScanStatus::accepted || !scan.model_from_scan) continue;
    poses.push_back({scan.name, *scan.model_from_scan});
    if (extension == ".csv") continue;
    ASBUILT_TRY(exported, scan_from_segment(folder / io::segment_file(i, scan.name)));
    exported.name = scan.name;
    exported.file_from_scan = *scan.model_from_scan;
    scans.push_back(std::move(exported));
  }
  if (poses.empty()) {
    return fail(ErrorCode::not_possible,
                fmt::format("{}: no scan was accepted, there is nothing to export", folder.string()));
  }
  if (extension == ".csv") {
    ASBUILT_CHECK(io::write_poses_csv(output, poses));
  } else {
    ASBUILT_CHECK(io::write_e57(output, scans));
  }
  return poses.size();
}

}  // namespace asbuilt::pipeline
