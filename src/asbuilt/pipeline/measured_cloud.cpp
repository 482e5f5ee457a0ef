// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/measured_cloud.h"

#include <fmt/format.h>

#include <utility>

#include "asbuilt/core/parallel.h"
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

/// The points of all scans in a file, sanitised. A file of one scan whose rows were all read may say more of each.
Result<void> read_points(const std::string& path, std::string_view content, const Options& options,
                         const Context& context, MeasuredCloud& measured) {
  const io::ReadOptions reading = scan_reading(options, path, context);
  ASBUILT_TRY(files, io::scans_in(path, content, reading));
  PointCloud& all = measured.cloud;
  for (const io::ScanFile& file : files) {
    scan::Sanitised clean = scan::sanitise(file.cloud, context);
    const Eigen::Vector3f offset = file.offset_mm.cast<float>();  // the model frame is near its origin
    if (!offset.isZero(0.0F)) {
      for (Eigen::Vector3f& position : clean.cloud.positions) position += offset;
    }
    if (files.size() == 1) {
      const PointColumns columns = point_columns(path, content, io::millimetres_per(reading.unit));
      const auto fits = [&](const auto& column) { return column.empty() || column.size() == file.cloud.size(); };
      if (fits(columns.scan) && fits(columns.support) && fits(columns.sigma_mm)) {
        measured.columns = columns.of_rows(clean.source_index);
      }
      all = std::move(clean.cloud);
      break;
    }
    all.positions.insert(all.positions.end(), clean.cloud.positions.begin(), clean.cloud.positions.end());
    all.normals.insert(all.normals.end(), clean.cloud.normals.begin(), clean.cloud.normals.end());
  }
  if (all.normals.size() != all.positions.size()) all.normals.clear();
  if (!all.empty()) return {};
  return fail(ErrorCode::unreadable_input, fmt::format("{}: holds no usable point", path));
}

}  // namespace

Result<MeasuredCloud> measured_cloud(const std::string& path, const LoadedModel& model, const Options& options,
                                     const Context& context) {
  MeasuredCloud measured;
  ASBUILT_TRY(content, io::FileContent::open(path));
  // A file with faces is a surface: its vertices alone would say nothing of a large triangle.
  if (has_faces(path, content.view())) {
    if (const auto mesh = io::read_mesh(path, options.scan_unit)) {
      measured.file = {path, io::sha256(content.view())};
      const double spacing = median_spacing(model.prepared.dense_samples.positions);
      measured.cloud = model::even_samples(*mesh, spacing, options.seed, context);
      return measured;
    }
  }
  // The digest goes over the same bytes meanwhile.
  Result<void> read;
  context.arena().run_blocks(2, [&](std::size_t which) {
    if (which == 0) {
      read = read_points(path, content.view(), options, context, measured);
    } else {
      measured.file = {path, io::sha256(content.view())};
    }
  });
  ASBUILT_CHECK(read);
  ASBUILT_CHECK(content.whole());
  return measured;
}

io::RunRecord record_of_model(const LoadedModel& model) {
  io::RunRecord record;
  record.version = kVersion;
  record.model = model.record;
  return record;
}

}  // namespace asbuilt::pipeline
