// SPDX-License-Identifier: Apache-2.0
#include "scene.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "asbuilt/core/random.h"
#include "asbuilt/evaluate/truth.h"
#include "asbuilt/graph/pose_graph.h"
#include "asbuilt/io/mesh_file.h"
#include "asbuilt/scan/occluders.h"
#include "asbuilt/scan/scan.h"
#include "asbuilt/simulate/simulate.h"

namespace asbuilt::bench {
namespace {

// The part's points of a scan, with the normals that the product would fit among all points.
Result<refine::View> true_view(const std::vector<Eigen::Vector3f>& points, const std::vector<std::uint8_t>& labels,
                               const Pose& model_from_scan, const Context& context) {
  PointCloud raw;
  raw.positions = points;
  scan::ViewpointRequest at_origin;
  at_origin.automatic = false;
  at_origin.stated.kind = scan::Viewpoint::Kind::point;
  ASBUILT_TRY(scan, scan::prepare_scan(raw, std::nullopt, at_origin, {}, context));
  refine::View view;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    if (labels[scan.source_index[i]] != simulate::Label::kPart) continue;
    view.segment_in_scan.positions.push_back(scan.cloud.positions[i]);
    view.segment_in_scan.normals.push_back(scan.cloud.normals[i]);
  }
  view.model_from_scan = model_from_scan;
  view.noise_sigma_mm = scan.noise_sigma_mm;
  view.viewpoint = scan.viewpoint;
  view.spacing_mm = scan.spacing_mm;
  view.beside_occluder = scan::Occluders(scan).beside(view.segment_in_scan, context);
  return view;
}

Eigen::Vector3d drawn_direction(Random& random) {
  Eigen::Vector3d direction;
  do {
    direction = {random.normal(), random.normal(), random.normal()};
  } while (direction.norm() < 1e-3);
  return direction.normalized();
}

}  // namespace

std::size_t RefinementScene::points() const {
  std::size_t sum = 0;
  for (const refine::View& view : views) sum += view.segment_in_scan.size();
  return sum;
}

Result<RefinementScene> scene_of_folder(const std::filesystem::path& folder, const Context& context) {
  ASBUILT_TRY(truth, evaluate::read_truth(folder));
  RefinementScene scene;
  scene.name = folder.filename().string();
  scene.noise_sigma_mm = truth.noise_sigma_mm;
  ASBUILT_TRY(model, io::read_mesh(truth.folder / truth.model, io::Unit::millimetre));
  ASBUILT_TRY(as_built, io::read_mesh(truth.folder / truth.as_built, io::Unit::millimetre));
  ASBUILT_TRY(prepared, model::prepare(model, {}, context));
  scene.model = std::move(model);
  scene.as_built = std::move(as_built);
  scene.prepared = std::move(prepared);
  for (const evaluate::TrueScan& scan : truth.scans) {
    if (!scan.model_from_scan) continue;
    ASBUILT_TRY(labelled, evaluate::read_labelled_points(truth, scan));
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3d& point : labelled.points_in_scan) points.push_back(point.cast<float>());
    ASBUILT_TRY(view, true_view(points, labelled.labels, *scan.model_from_scan, context));
    scene.views.push_back(std::move(view));
    scene.truth.push_back(*scan.model_from_scan);
    scene.names.push_back(scan.path.stem().string());
  }
  return scene;
}

Result<RefinementScene> simulated_scene(const std::string& name, const TriangleMesh& cad,
                                        const simulate::SimulateOptions& options, const Context& context) {
  ASBUILT_TRY(simulation, simulate::simulate(cad, options, context));
  RefinementScene scene;
  scene.name = name;
  scene.noise_sigma_mm = simulation.noise_sigma_mm;
  ASBUILT_TRY(prepared, model::prepare(simulation.model, {}, context));
  scene.model = std::move(simulation.model);
  scene.as_built = std::move(simulation.as_built);
  scene.prepared = std::move(prepared);
  for (const simulate::SimulatedScan& scan : simulation.scans) {
    if (!scan.model_from_scan) continue;
    ASBUILT_TRY(view, true_view(scan.points_in_scan, scan.labels, *scan.model_from_scan, context));
    if (view.segment_in_scan.size() < 100) continue;
    scene.views.push_back(std::move(view));
    scene.truth.push_back(*scan.model_from_scan);
    scene.names.push_back(scan.name);
  }
  return scene;
}

std::vector<refine::View> perturbed(const RefinementScene& scene, double angle_deg, double shift_ratio,
                                    std::uint64_t seed) {
  std::vector<refine::View> views = scene.views;
  const Eigen::Vector3d middle = scene.prepared.box.center();
  for (std::size_t v = 0; v < views.size(); ++v) {
    Random random(seed, "refinement start", v);
    const double angle = angle_deg * std::numbers::pi / 180.0;
    const Eigen::Vector3d axis = drawn_direction(random), direction = drawn_direction(random);
    const Pose motion = Eigen::Translation3d(middle + shift_ratio * scene.diameter_mm() * direction) *
                        Eigen::AngleAxisd(angle, axis) * Eigen::Translation3d(-middle);
    views[v].model_from_scan = motion * scene.truth[v];
  }
  return views;
}

Result<std::vector<refine::Link>> product_links(const RefinementScene& scene, std::span<const refine::View> views,
                                                const Context& context) {
  std::vector<graph::PosedSegment> segments;
  for (const refine::View& view : views) segments.push_back({view.segment_in_scan, view.model_from_scan});
  ASBUILT_TRY(graph, graph::build_graph(segments, scene.prepared, {}, context));
  std::vector<refine::Link> links;
  for (const graph::PairOverlap& edge : graph.edges) links.push_back({edge.first, edge.second});
  return links;
}

}  // namespace asbuilt::bench
