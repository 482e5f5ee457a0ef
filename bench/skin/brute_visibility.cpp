// SPDX-License-Identifier: Apache-2.0
#include "brute_visibility.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "asbuilt/core/parallel.h"
#include "asbuilt/core/random.h"

namespace asbuilt::bench {

std::vector<Spot> spots_on(const TriangleMesh& mesh, std::size_t count) {
  std::vector<Spot> spots;
  const double step = surface_area(mesh) / static_cast<double>(count);
  Random random(7, "spots of the skin bench", 0);
  double passed = 0.0, next = step * random.uniform();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Eigen::Vector3d doubled = doubled_area_vector(mesh, i);
    passed += 0.5 * doubled.norm();
    const auto corner = [&](int k) { return mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][k])]; };
    for (; next < passed; next += step) {
      const double root = std::sqrt(random.uniform()), along = random.uniform();
      spots.push_back({(1.0 - root) * corner(0) + root * (1.0 - along) * corner(1) + root * along * corner(2),
                       doubled.stableNormalized(), static_cast<std::uint32_t>(i)});
    }
  }
  return spots;
}

std::vector<Eigen::Vector3d> viewpoints_around(const TriangleMesh& mesh, std::size_t count) {
  const Eigen::Vector3d centre = bounding_box(mesh).center();
  const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<Eigen::Vector3d> viewpoints;
  for (const double radius : {3.0 * diameter(mesh), 0.75 * diameter(mesh)}) {
    const std::size_t here = count / 2;
    for (std::size_t i = 0; i < here; ++i) {
      const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / static_cast<double>(here);
      const double across = std::sqrt(1.0 - z * z), angle = golden_angle * static_cast<double>(i);
      viewpoints.emplace_back(centre + radius * Eigen::Vector3d(across * std::cos(angle), across * std::sin(angle), z));
    }
  }
  // In random order, so that a visible spot is found so after a few rays, wherever it faces.
  Random random(7, "viewpoints of the skin bench", 0);
  for (std::size_t i = viewpoints.size(); i > 1; --i) std::swap(viewpoints[i - 1], viewpoints[random.below(i)]);
  return viewpoints;
}

std::vector<int> views_of(const std::vector<Spot>& spots, const std::vector<Eigen::Vector3d>& viewpoints,
                          const model::RayScene& scene, double lift_off_mm, int enough, const Context& context) {
  std::vector<int> views(spots.size(), 0);
  parallel_for(context, spots.size(), 64, [&](std::size_t i) {
    for (const Eigen::Vector3d& viewpoint : viewpoints) {
      if (views[i] == enough) return;
      const Eigen::Vector3d to_viewpoint = viewpoint - spots[i].position;
      const double side = to_viewpoint.dot(spots[i].normal) < 0.0 ? -1.0 : 1.0;
      const Eigen::Vector3d origin = spots[i].position + side * lift_off_mm * spots[i].normal;
      if (!scene.is_blocked(origin, viewpoint - origin, 0.0, 1.0)) ++views[i];
    }
  });
  return views;
}

}  // namespace asbuilt::bench
