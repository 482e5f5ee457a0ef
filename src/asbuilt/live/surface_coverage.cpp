// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/live/surface_coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"

namespace asbuilt::live {
namespace {

constexpr double kEdgesAcross = 100.0;  // edges to a diameter: fine enough to see a hole, coarse enough for a page
constexpr float kSameWay = 0.5F;        // 60 degrees
constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

std::vector<std::uint32_t> places_of(const std::vector<Eigen::Vector3d>& vertices) {
  std::map<std::tuple<double, double, double>, std::uint32_t> first;
  std::vector<std::uint32_t> place(vertices.size());
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    const Eigen::Vector3d& p = vertices[v];
    place[v] = first.try_emplace({p.x(), p.y(), p.z()}, v).first->second;
  }
  return place;
}

double triangle_area(const model::SurfaceMesh& mesh, const std::array<std::uint32_t, 3>& t) {
  const Eigen::Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
  return 0.5 * (b - a).cross(c - a).norm();
}

// The largest piece of a vertex lies on this CAD face; ties go to the lower number.
std::vector<std::uint32_t> faces_of_vertices(const model::SurfaceMesh& mesh) {
  if (mesh.faces.empty()) return {};
  std::vector<std::map<std::uint32_t, double>> area(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) area[v][mesh.faces[t]] += triangle_area(mesh, mesh.triangles[t]);
  }
  std::vector<std::uint32_t> face(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < face.size(); ++v) {
    const auto most = std::ranges::max_element(area[v], {}, [](const auto& entry) { return entry.second; });
    if (most != area[v].end()) face[v] = most->first;
  }
  return face;
}

}  // namespace

Surface surface_of(const model::PreparedModel& model) {
  Surface surface;
  surface.edge_mm = model.diameter / kEdgesAcross;
  surface.mesh = model::surface_mesh(model.skin, {.edge_length_mm = surface.edge_mm});
  surface.area_mm2.assign(surface.mesh.vertices.size(), 0.0);
  surface.place = places_of(surface.mesh.vertices);
  surface.neighbours.resize(surface.mesh.vertices.size());
  for (const auto& t : surface.mesh.triangles) {
    const double area = triangle_area(surface.mesh, t);
    surface.total_area_mm2 += area;
    for (std::size_t k = 0; k < 3; ++k) {
      surface.area_mm2[t[k]] += area / 3.0;
      const std::uint32_t a = surface.place[t[k]], b = surface.place[t[(k + 1) % 3]];
      surface.neighbours[a].push_back(b);
      surface.neighbours[b].push_back(a);
    }
  }
  for (auto& list : surface.neighbours) {
    std::ranges::sort(list);
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  surface.face = faces_of_vertices(surface.mesh);
  return surface;
}

SeenDeviation seen_from(const PointCloud& part_in_scan, const Pose& model_from_scan, double spacing_mm,
                        const Surface& surface, const model::PreparedModel& model, const Context& context) {
  SeenDeviation seen(surface.mesh.vertices.size(), kNothing);
  if (part_in_scan.empty()) return seen;
  const std::vector<std::uint32_t> chosen = even_subset(part_in_scan.positions, 0.5 * surface.edge_mm, context);
  std::vector<Eigen::Vector3f> feet(chosen.size()), normals(chosen.size());
  std::vector<float> deviation(chosen.size());
  parallel_for(context, chosen.size(), 512, [&](std::size_t i) {
    const auto nearest = model.surface->nearest(model_from_scan * part_in_scan.positions[chosen[i]].cast<double>());
    feet[i] = nearest.point.cast<float>();
    normals[i] = (model_from_scan.linear() * part_in_scan.normals[chosen[i]].cast<double>()).cast<float>();
    deviation[i] = static_cast<float>(nearest.signed_distance);
  });
  const KdTree tree(feet);
  const auto reach = static_cast<float>(std::max(1.5 * surface.edge_mm, 2.0 * spacing_mm));
  parallel_for(context, seen.size(), 512, [&](std::size_t v) {
    const auto found =
        tree.nearest_facing(surface.mesh.vertices[v].cast<float>(), reach, normals, surface.mesh.normals[v], kSameWay);
    if (found.found()) seen[v] = deviation[found.index];
  });
  return seen;
}

namespace {

Hole hole_of(std::vector<std::uint32_t> vertices, const Surface& surface) {
  Hole hole;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d box;
  std::map<std::uint32_t, double> face_area;
  for (const std::uint32_t v : vertices) {
    const double area = surface.area_mm2[v];
    hole.area_mm2 += area;
    middle += area * surface.mesh.vertices[v];
    normal += area * surface.mesh.normals[v].cast<double>();
    box.extend(surface.mesh.vertices[v]);
    if (!surface.face.empty()) face_area[surface.face[v]] += area;
  }
  middle /= std::max(hole.area_mm2, 1e-12);
  hole.share = hole.area_mm2 / surface.total_area_mm2;
  hole.extent_mm = box.diagonal().norm();
  if (normal.norm() > 0.2 * hole.area_mm2) hole.normal = normal.normalized();
  const auto nearest = std::ranges::min_element(
      vertices, {}, [&](std::uint32_t v) { return (surface.mesh.vertices[v] - middle).squaredNorm(); });
  hole.centre = surface.mesh.vertices[*nearest];
  const auto most = std::ranges::max_element(face_area, {}, [](const auto& entry) { return entry.second; });
  if (most != face_area.end()) hole.face = static_cast<int>(most->first);
  hole.vertices = std::move(vertices);
  return hole;
}

}  // namespace

std::vector<Hole> holes(const Surface& surface, const std::vector<std::uint16_t>& support, double smallest_share,
                        std::size_t most) {
  const std::size_t count = support.size();
  std::vector<char> open(count, 0), visited(count, 0);  // by place: seen on none of its sides
  for (std::size_t v = 0; v < count; ++v) open[v] = 1;
  for (std::size_t v = 0; v < count; ++v) {
    if (support[v] > 0) open[surface.place[v]] = 0;
  }
  std::vector<std::vector<std::uint32_t>> at_place(count);
  for (std::uint32_t v = 0; v < count; ++v) at_place[surface.place[v]].push_back(v);
  std::vector<Hole> found;
  for (std::uint32_t start = 0; start < count; ++start) {
    if (surface.place[start] != start || !open[start] || visited[start]) continue;
    std::vector<std::uint32_t> stack{start}, vertices;
    visited[start] = 1;
    while (!stack.empty()) {
      const std::uint32_t here = stack.back();
      stack.pop_back();
      vertices.insert(vertices.end(), at_place[here].begin(), at_place[here].end());
      for (const std::uint32_t next : surface.neighbours[here]) {
        if (!open[next] || visited[next]) continue;
        visited[next] = 1;
        stack.push_back(next);
      }
    }
    double area = 0.0;
    for (const std::uint32_t v : vertices) area += surface.area_mm2[v];
    if (area >= smallest_share * surface.total_area_mm2) found.push_back(hole_of(std::move(vertices), surface));
  }
  std::ranges::stable_sort(found, std::greater<>{}, &Hole::area_mm2);
  if (found.size() > most) found.resize(most);
  return found;
}

}  // namespace asbuilt::live
