// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/pipeline/measured_cloud.h"

#include <fmt/format.h>

#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/pipeline/pipeline_version.h"
#include "asbuilt/scan/sanitise.h"

namespace asbuilt::pipeline {
namespace {

Result<PointCloud> points_of(const std::string& path, const Options& options, const Context& context) {
  ASBUILT_TRY(files, io::read_scans(path, scan_reading(options, path)));
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

Result<PointCloud> measured_cloud(const std::string& path, const LoadedModel& model, const Options& options,
                                  const Context& context) {
  // A file with faces is a surface: its vertices alone would say nothing of a large triangle.
  const auto mesh = io::read_mesh(path, options.scan_unit);
  if (!mesh) return points_of(path, options, context);
  return model::even_samples(*mesh, median_spacing(model.prepared.dense_samples.positions), options.seed, context);
}

io::RunRecord record_of_model(const LoadedModel& model) {
  io::RunRecord record;
  record.version = kVersion;
  record.model = model.record;
  return record;
}

}  // namespace asbuilt::pipeline
