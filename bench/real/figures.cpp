// SPDX-License-Identifier: Apache-2.0
#include "figures.h"

#include <algorithm>
#include <optional>
#include <span>

#include "asbuilt/core/pose.h"
#include "asbuilt/core/triangle_mesh.h"
#include "asbuilt/evaluate/evaluate.h"
#include "asbuilt/evaluate/pose_error.h"
#include "asbuilt/evaluate/surface_error.h"
#include "asbuilt/evaluate/truth.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/io/run_record.h"
#include "asbuilt/io/scan_file.h"
#include "asbuilt/model/surface_distance.h"

namespace asbuilt::bench {
namespace {

std::filesystem::path reference_of(const RealRun& run, const std::string& scan_name) {
  return std::filesystem::is_directory(run.reference) ? run.reference / (scan_name + ".txt") : run.reference;
}

Eigen::Vector3d surface_centroid(const TriangleMesh& mesh) {
  Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
  double total = 0.0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const double area = doubled_area_vector(mesh, i).norm();
    for (int corner = 0; corner < 3; ++corner) {
      weighted += area / 3.0 * mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][corner])];
    }
    total += area;
  }
  return weighted / total;
}

/// Mean over the points of several scans.
class PooledMean {
 public:
  void add(const io::ScanFile& scan, const Pose& model_from_scan, const model::SurfaceDistance& surface,
           const Context& context) {
    const auto finite = static_cast<double>(
        std::ranges::count_if(scan.cloud.positions, [](const Eigen::Vector3f& point) { return point.allFinite(); }));
    const Pose model_from_local = model_from_scan * Eigen::Translation3d(scan.offset_mm);
    sum_ += finite * evaluate::mean_surface_distance(std::span<const Eigen::Vector3f>(scan.cloud.positions),
                                                     model_from_local, surface, context);
    count_ += finite;
  }
  [[nodiscard]] std::optional<double> value() const {
    return count_ > 0.0 ? std::optional(sum_ / count_) : std::nullopt;
  }

 private:
  double sum_ = 0.0, count_ = 0.0;
};

}  // namespace

Result<RealFigures> measure(const RealRun& run, const Context& context) {
  ASBUILT_TRY(record, io::read_run_record(run.result_dir / "result.json"));
  ASBUILT_TRY(mesh, io::read_mesh(run.model, run.unit));
  const model::SurfaceDistance surface(mesh);
  const Eigen::Vector3d centroid = surface_centroid(mesh);

  RealFigures figures;
  figures.diameter_mm = diameter(mesh);
  figures.given = record.scans.size();
  figures.components = record.graph ? record.graph->components.size() : 0;
  PooledMean ours, reference;
  for (const io::ScanRecord& scan : record.scans) {
    ASBUILT_TRY(true_pose, evaluate::read_reference_pose(reference_of(run, scan.name), run.unit));
    PoseFigures pose{scan.name, std::string(name_of(scan.status)), scan.reason};
    pose.accepted = scan.status == io::ScanStatus::accepted && scan.model_from_scan.has_value();
    const auto& found = pose.accepted ? scan.model_from_scan : scan.model_from_scan_detected;
    if (found) {
      const evaluate::PoseError error = evaluate::pose_error(*found, true_pose, mesh);
      pose.angle_deg = error.angle_deg;
      pose.centroid_mm = (*found * true_pose.inverse() * centroid - centroid).norm();
      pose.worst_vertex_mm = error.max_vertex_mm;
    }
    if (pose.accepted) {
      pose.right = pose.worst_vertex_mm <= evaluate::EvaluateOptions{}.right_ratio * figures.diameter_mm;
      ++figures.accepted;
      ++(pose.right ? figures.right : figures.wrong);
      ASBUILT_TRY(files, io::read_scans(scan.path, run.unit));
      const io::ScanFile& file = files.at(static_cast<std::size_t>(scan.index_in_file));
      ours.add(file, *scan.model_from_scan, surface, context);
      reference.add(file, true_pose, surface, context);
    }
    figures.poses.push_back(pose);
  }
  figures.mean_distance_mm = ours.value();
  figures.reference_distance_mm = reference.value();
  return figures;
}

}  // namespace asbuilt::bench
