// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/large_planes.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::detect {
namespace {

// Neighbours that continue a plane: nearly the same normal, and each in the other's plane.
std::vector<std::vector<std::uint32_t>> flat_links(const PointCloud& samples, double spacing_mm,
                                                   const Context& context) {
  const auto min_cosine = static_cast<float>(std::cos(0.10));
  const auto max_height = static_cast<float>(0.25 * spacing_mm);
  const KdTree tree(samples.positions);
  std::vector<std::vector<std::uint32_t>> links(samples.size());
  parallel_for_blocks(context, samples.size(), 512, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      tree.within(samples.positions[i], static_cast<float>(2.2 * spacing_mm), neighbours);
      for (const KdTree::Neighbour& neighbour : neighbours) {
        const std::uint32_t j = neighbour.index;
        if (j <= i || std::abs(samples.normals[i].dot(samples.normals[j])) < min_cosine) continue;
        const Eigen::Vector3f offset = samples.positions[j] - samples.positions[i];
        const float height =
            std::max(std::abs(offset.dot(samples.normals[i])), std::abs(offset.dot(samples.normals[j])));
        if (height <= max_height) links[i].push_back(j);
      }
    }
  });
  return links;
}

// Whether the members lie in one plane (a gently curved wall chains up too, but is no plane) and reach far.
bool is_large_plane(const PointCloud& samples, const std::vector<int>& members, double spacing_mm,
                    double largest_extent_mm) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int i : members) mean += samples.positions[static_cast<std::size_t>(i)].cast<double>();
  mean /= static_cast<double>(members.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const int i : members) {
    const Eigen::Vector3d offset = samples.positions[static_cast<std::size_t>(i)].cast<double>() - mean;
    covariance += offset * offset.transpose();
  }
  covariance /= static_cast<double>(members.size());
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  if (std::sqrt(std::max(0.0, solver.eigenvalues()[0])) > 0.3 * spacing_mm) return false;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const Eigen::Vector3d axis = solver.eigenvectors().col(2);
  for (const int i : members) {
    const double along = axis.dot(samples.positions[static_cast<std::size_t>(i)].cast<double>() - mean);
    low = std::min(low, along);
    high = std::max(high, along);
  }
  return high - low > largest_extent_mm;
}

}  // namespace

std::vector<std::uint8_t> on_large_planes(const PointCloud& samples, double spacing_mm, double largest_extent_mm,
                                          const Context& context) {
  std::vector<std::uint8_t> marks(samples.size(), 0);
  const std::vector<std::vector<std::uint32_t>> links = flat_links(samples, spacing_mm, context);
  DisjointSets pieces(static_cast<int>(samples.size()));
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const std::uint32_t j : links[i]) pieces.unite(static_cast<int>(i), static_cast<int>(j));
  }
  for (const std::vector<int>& members : pieces.by_decreasing_size()) {
    // A piece that long has at least so many samples in a row.
    if (static_cast<double>(members.size()) * spacing_mm < largest_extent_mm) break;
    if (!is_large_plane(samples, members, spacing_mm, largest_extent_mm)) continue;
    for (const int i : members) marks[static_cast<std::size_t>(i)] = 1;
  }
  return marks;
}

SampledScan sampled_scan(const scan::Scan& scan, double spacing_mm, double diameter_mm, const Context& context) {
  SampledScan sampled{scan::downsample(scan, spacing_mm, spacing_mm, context), spacing_mm, {}};
  sampled.on_large_plane = on_large_planes(sampled.samples, spacing_mm, kLargestExtentRatio * diameter_mm, context);
  return sampled;
}

std::vector<std::uint8_t> points_on_large_planes(const scan::Scan& scan, const SampledScan& sampled,
                                                 const Context& context) {
  PointCloud planes;
  for (std::size_t i = 0; i < sampled.samples.size(); ++i) {
    if (sampled.on_large_plane[i] == 0) continue;
    planes.positions.push_back(sampled.samples.positions[i]);
    planes.normals.push_back(sampled.samples.normals[i]);
  }
  std::vector<std::uint8_t> marks(scan.cloud.size(), 0);
  if (planes.empty()) return marks;
  const KdTree tree(planes.positions);
  const auto reach = static_cast<float>(1.5 * sampled.spacing_mm);
  const auto height = static_cast<float>(4.0 * scan.noise_sigma_mm + 0.02 * sampled.spacing_mm);
  constexpr float kAgreeing = 0.9F;
  parallel_for(context, scan.cloud.size(), 2048, [&](std::size_t i) {
    const KdTree::Neighbour nearest = tree.nearest(scan.cloud.positions[i], reach);
    if (!nearest.found()) return;
    const Eigen::Vector3f& normal = planes.normals[nearest.index];
    const Eigen::Vector3f offset = scan.cloud.positions[i] - planes.positions[nearest.index];
    marks[i] = std::abs(offset.dot(normal)) <= height && std::abs(normal.dot(scan.cloud.normals[i])) >= kAgreeing;
  });
  return marks;
}

}  // namespace asbuilt::detect
