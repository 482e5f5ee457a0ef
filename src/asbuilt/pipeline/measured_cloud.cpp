// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/measured_cloud.h"

#include <fmt/format.h>

#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/io/file.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/pipeline_version.h"
#include "asbuilt/scan/sanitise.h"

namespace asbuilt::pipeline {
namespace {

/// Whether a file can be a mesh; a PLY file without the element "face" need not be read twice to find out.
bool has_faces(const std::string& path, std::string_view content) {
  if (!content.starts_with("ply")) return io::is_model_name(path) || content.size() < (std::size_t{1} << 26);
  const std::string_view header = content.substr(0, content.find("end_header"));
  return header.find("element face") != std::string_view::npos;
}

Result<PointCloud> points_of(const std::string& path, std::string_view content, const Options& options,
                             const Context& context) {
  ASBUILT_TRY(files, io::scans_in(path, content, scan_reading(options, path)));
  PointCloud all;
  for (const io::ScanFile& file : files) {
    const PointCloud cloud = scan::sanitise(file.cloud, context).cloud;
    const Eigen::Vector3f offset = file.offset_mm.cast<float>();  // the model frame is near its origin
    for (const Eigen::Vector3f& position : cloud.positions) all.positions.push_back(position + offset);
    all.normals.insert(all.normals.end(), cloud.normals.begin(), cloud.normals.end());
  }
  if (all.normals.size() != all.positions.size()) all.normals.clear();
  if (!all.empty()) return all;
  return fail(ErrorCode::unreadable_input, fmt::format("{}: holds no usable point", path));
}

}  // namespace

Result<MeasuredCloud> measured_cloud(const std::string& path, const LoadedModel& model, const Options& options,
                                     const Context& context) {
  MeasuredCloud measured;
  ASBUILT_TRY(content, io::FileContent::open(path));
  measured.file = {path, io::sha256(content.view())};
  // A file with faces is a surface: its vertices alone would say nothing of a large triangle.
  if (has_faces(path, content.view())) {
    if (const auto mesh = io::read_mesh(path, options.scan_unit)) {
      const double spacing = median_spacing(model.prepared.dense_samples.positions);
      measured.cloud = model::even_samples(*mesh, spacing, options.seed, context);
      return measured;
    }
  }
  ASBUILT_TRY(points, points_of(path, content.view(), options, context));
  ASBUILT_CHECK(content.whole());
  measured.cloud = std::move(points);
  return measured;
}

io::RunRecord record_of_model(const LoadedModel& model) {
  io::RunRecord record;
  record.version = kVersion;
  record.model = model.record;
  return record;
}

}  // namespace asbuilt::pipeline
