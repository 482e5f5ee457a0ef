// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/sampling_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/model/distance_field.h"

namespace asbuilt::model {
namespace {

constexpr double kFinest = 0.025, kCoarsest = 0.05;  // tau in the paper's experiments
constexpr double kGoodCount = 1000.0, kMostSamples = 2500.0;
constexpr double kSamplesPerArea = 0.8;  // what even_samples() gives per square of the spacing
constexpr double kAcrossSmallest = 4.0;  // samples across a slim part
constexpr double kFinestVoxel = 1.0 / 400.0, kCoarsestVoxel = 1.0 / 256.0;  // of the diameter
constexpr double kMaxFieldBytes = 48e6;
constexpr double kBricksPerPatch = 2.6;  // bricks touched per square of a brick's side of surface

}  // namespace

Eigen::Vector3d principal_extents(const TriangleMesh& mesh) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double total = 0.0;
  const auto middle = [&](const Eigen::Vector3i& t) {
    const auto at = [&](int k) -> const Eigen::Vector3d& { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    return Eigen::Vector3d((at(0) + at(1) + at(2)) / 3.0);
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const double area = doubled_area_vector(mesh, i).norm();
    mean += area * middle(mesh.triangles[i]);
    total += area;
  }
  mean /= total;
  // The second moment of a triangle: its corners and three times its middle, each with a twelfth of the area.
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const double area = doubled_area_vector(mesh, i).norm();
    const auto add = [&](const Eigen::Vector3d& offset) { spread += area * offset * offset.transpose(); };
    for (int k = 0; k < 3; ++k) add(mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][k])] - mean);
    add(3.0 * (middle(mesh.triangles[i]) - mean));
  }
  const Eigen::Matrix3d axes = SymmetricEigen<3>(spread).eigenvectors();
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3i& triangle : mesh.triangles) {
    for (int k = 0; k < 3; ++k)
      box.extend(axes.transpose() * (mesh.vertices[static_cast<std::size_t>(triangle[k])] - mean));
  }
  Eigen::Vector3d extents = box.sizes();
  std::sort(extents.begin(), extents.end());
  return extents;
}

double choose_sampling_ratio(const TriangleMesh& skin) {
  const double whole = diameter(skin);
  const double area = surface_area(skin);
  const auto ratio_for = [&](double count) { return std::sqrt(kSamplesPerArea * area / count) / whole; };
  const double wanted = std::min(ratio_for(kGoodCount), principal_extents(skin)[0] / kAcrossSmallest / whole);
  return std::clamp(std::max(wanted, ratio_for(kMostSamples)), kFinest, kCoarsest);
}

double thin_wall(const PointCloud& samples, const RayScene& rays, double diameter) {
  const double lift_off = 1e-5 * diameter;
  std::vector<double> thickness;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3d inwards = -samples.normals[i].cast<double>();
    const RayScene::Hit hit = rays.first_hit(samples.positions[i].cast<double>() + lift_off * inwards, inwards);
    if (hit.found()) thickness.push_back(hit.distance + lift_off);
  }
  if (thickness.empty()) return std::numeric_limits<double>::infinity();
  const auto tenth = thickness.begin() + static_cast<std::ptrdiff_t>(thickness.size() / 10);
  std::nth_element(thickness.begin(), tenth, thickness.end());
  return *tenth;
}

double choose_voxel(double diameter, double surface_area, double thin_wall) {
  const double for_walls = std::clamp(0.5 * thin_wall, kFinestVoxel * diameter, kCoarsestVoxel * diameter);
  constexpr double kBytesPerBrick = 8.0 * static_cast<double>(DistanceField::kNodesPerBrick);
  const double most_bricks = kMaxFieldBytes / kBytesPerBrick;
  const double for_memory = std::sqrt(kBricksPerPatch * surface_area / most_bricks) / DistanceField::kBrickCells;
  return std::max(for_walls, for_memory);
}

}  // namespace asbuilt::model
