// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/report/scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/io/base64.h"

namespace asbuilt::report {
namespace {

constexpr std::size_t kMostTriangles = 150000;

std::vector<std::uint32_t> faces_of(const model::SurfaceMesh& mesh, const model::PreparedModel& model,
                                    const inspect::FaceMap& map, const Context& context) {
  std::vector<std::uint32_t> faces(mesh.triangles.size());
  parallel_for(context, faces.size(), 512, [&](std::size_t i) {
    std::uint32_t triangle = 0;
    if (!mesh.skin_triangles.empty()) {
      triangle = mesh.skin_triangles[i];
    } else {  // of a thinned skin: whose surface is nearest
      const auto& t = mesh.triangles[i];
      const Eigen::Vector3d middle = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0;
      triangle = model.surface->nearest(middle).triangle;
    }
    faces[i] = map.of_triangle[triangle];
  });
  return faces;
}

/// A vertex belongs to the region of the nearest spot on its side.
std::vector<std::uint16_t> regions_of(const PointCloud& vertices, const model::PreparedModel& model,
                                      const inspect::DeviationReport& deviations, const Context& context) {
  std::vector<std::uint16_t> regions(vertices.size(), Scene::kNone);
  if (deviations.regions.empty()) return regions;
  const KdTree tree(model.dense_samples.positions);
  const auto reach = static_cast<float>(1.5 * median_spacing(model.dense_samples.positions, tree));
  parallel_for(context, vertices.size(), 512, [&](std::size_t i) {
    const auto spot =
        tree.nearest_facing(vertices.positions[i], reach, model.dense_samples.normals, vertices.normals[i], 0.5F);
    if (!spot.found() || deviations.region_of_spot[spot.index] < 0) return;
    regions[i] = static_cast<std::uint16_t>(deviations.region_of_spot[spot.index]);
  });
  return regions;
}

template <class Value, class Of>
std::vector<Value> per_vertex(const Scene& scene, const Of& of) {
  std::vector<Value> values;
  values.reserve(scene.spots.size());
  for (const inspect::Spot& spot : scene.spots) values.push_back(of(spot));
  return values;
}

template <class Value>
std::string packed(const std::vector<Value>& values) {
  return io::packed_json(std::span<const Value>(values));
}

std::string poses_json(const io::RunRecord& record) {
  std::string text = "[";
  for (std::size_t i = 0; i < record.scans.size(); ++i) {
    const io::ScanRecord& scan = record.scans[i];
    if (!scan.model_from_scan) continue;
    std::vector<double> numbers;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) numbers.push_back(scan.model_from_scan->matrix()(row, column));
    }
    const std::string viewpoint =
        scan.viewpoint && scan.viewpoint_kind == "point"
            ? fmt::format("[{}, {}, {}]", scan.viewpoint->x(), scan.viewpoint->y(), scan.viewpoint->z())
            : "null";
    text += fmt::format(R"({}{{"scan": {}, "model_from_scan": [{}], "viewpoint": {}}})", text.size() > 1 ? ", " : "", i,
                        fmt::join(numbers, ", "), viewpoint);
  }
  return text + "]";
}

}  // namespace

Scene scene_of(const model::PreparedModel& model, const inspect::DeviationReport& deviations, const Context& context) {
  Scene scene;
  model::SurfaceMeshOptions options;
  options.edge_length_mm = 1.5 * median_spacing(model.dense_samples.positions);
  options.max_triangles = kMostTriangles;
  scene.mesh = model::surface_mesh(model.skin, options);
  scene.face_of_triangle = faces_of(scene.mesh, model, deviations.face_map, context);
  PointCloud vertices;
  for (const Eigen::Vector3d& vertex : scene.mesh.vertices) vertices.positions.push_back(vertex.cast<float>());
  vertices.normals = scene.mesh.normals;
  scene.spots = deviations.finder->detailed_at(vertices, context);
  scene.region = regions_of(vertices, model, deviations, context);
  return scene;
}

std::string scene_json(const Scene& scene, const io::RunRecord& record) {
  std::vector<std::uint32_t> corners;
  for (const auto& t : scene.mesh.triangles) corners.insert(corners.end(), t.begin(), t.end());
  const auto deviation = per_vertex<float>(scene, [](const inspect::Spot& s) { return s.deviation_mm; });
  const auto sigma = per_vertex<float>(scene, [](const inspect::Spot& s) { return s.standard_error_mm; });
  const auto support = per_vertex<std::uint16_t>(scene, [](const inspect::Spot& s) { return s.scans; });
  const auto scan = per_vertex<std::uint16_t>(scene, [](const inspect::Spot& s) { return s.scan; });
  return fmt::format(
      "{{\"schema\": 1,\n\"vertices\": {},\n\"triangles\": {},\n\"faces\": {},\n\"deviation\": {},\n"
      "\"sigma\": {},\n\"support\": {},\n\"scan\": {},\n\"region\": {},\n\"poses\": {}}}",
      io::packed_positions_json(scene.mesh.vertices), packed(corners), packed(scene.face_of_triangle),
      packed(deviation), packed(sigma), packed(support), packed(scan), packed(scene.region), poses_json(record));
}

}  // namespace asbuilt::report
