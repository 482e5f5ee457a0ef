// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/large_planes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::detect {
namespace {

constexpr float kReach = 2.2F, kSamePlane = 0.25F;  // spacings: along a plane to its next samples, and off it

// Neighbours that continue a plane: nearly the same normal, and each in the other's plane.
std::vector<std::vector<std::uint32_t>> flat_links(const PointCloud& samples, std::span<const float> spacings_mm,
                                                   const Context& context) {
  const auto min_cosine = static_cast<float>(std::cos(0.10));
  const KdTree tree(samples.positions);
  std::vector<std::vector<std::uint32_t>> links(samples.size());
  parallel_for_blocks(context, samples.size(), 512, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    for (std::size_t i = begin; i < end; ++i) {
      tree.within(samples.positions[i], kReach * spacings_mm[i], neighbours);
      for (const KdTree::Neighbour& neighbour : neighbours) {
        const std::uint32_t j = neighbour.index;
        if (j == i || (j < i && spacings_mm[j] >= spacings_mm[i])) continue;  // j found i
        if (std::abs(samples.normals[i].dot(samples.normals[j])) < min_cosine) continue;
        const Eigen::Vector3f offset = samples.positions[j] - samples.positions[i];
        const float height =
            std::max(std::abs(offset.dot(samples.normals[i])), std::abs(offset.dot(samples.normals[j])));
        if (height <= kSamePlane * spacings_mm[i]) links[i].push_back(j);
      }
    }
  });
  return links;
}

// Whether the members lie in one plane (a gently curved wall chains up too, but is no plane) and reach far.
bool is_large_plane(const PointCloud& samples, std::span<const float> spacings_mm, const std::vector<int>& members,
                    double largest_extent_mm) {
  double spacing_mm = 0.0;
  for (const int i : members) spacing_mm += static_cast<double>(spacings_mm[static_cast<std::size_t>(i)]);
  spacing_mm /= static_cast<double>(members.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const int i : members) mean += samples.positions[static_cast<std::size_t>(i)].cast<double>();
  mean /= static_cast<double>(members.size());
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const int i : members) {
    const Eigen::Vector3d offset = samples.positions[static_cast<std::size_t>(i)].cast<double>() - mean;
    covariance += offset * offset.transpose();
  }
  covariance /= static_cast<double>(members.size());
  const SymmetricEigen<3> solver(covariance);
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

std::vector<std::uint8_t> on_large_planes(const PointCloud& samples, std::span<const float> spacings_mm,
                                          double largest_extent_mm, const Context& context) {
  ASBUILT_EXPECT(spacings_mm.size() == samples.size(), "one spacing a sample");
  std::vector<std::uint8_t> marks(samples.size(), 0);
  if (samples.empty()) return marks;
  const double widest_mm = *std::ranges::max_element(spacings_mm);
  const std::vector<std::vector<std::uint32_t>> links = flat_links(samples, spacings_mm, context);
  DisjointSets pieces(static_cast<int>(samples.size()));
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const std::uint32_t j : links[i]) pieces.unite(static_cast<int>(i), static_cast<int>(j));
  }
  for (const std::vector<int>& members : pieces.by_decreasing_size()) {
    // A piece that long has at least so many samples in a row.
    if (static_cast<double>(members.size()) * widest_mm < largest_extent_mm) break;
    if (!is_large_plane(samples, spacings_mm, members, largest_extent_mm)) continue;
    for (const int i : members) marks[static_cast<std::size_t>(i)] = 1;
  }
  return marks;
}

SampledScan sampled_scan(const scan::Scan& scan, double spacing_mm, double diameter_mm, const Context& context) {
  SampledScan sampled{scan::downsample(scan, spacing_mm, spacing_mm, context), {}, {}};
  for (const Eigen::Vector3f& sample : sampled.samples.positions) {
    sampled.spacings_mm.push_back(static_cast<float>(std::max(spacing_mm, scan.spacing_at(sample.cast<double>()))));
  }
  sampled.on_large_plane =
      on_large_planes(sampled.samples, sampled.spacings_mm, kLargestExtentRatio * diameter_mm, context);
  return sampled;
}

std::vector<std::uint8_t> points_on_large_planes(const scan::Scan& scan, const SampledScan& sampled,
                                                 const Context& context) {
  PointCloud planes;
  std::vector<float> spacings_mm;
  for (std::size_t i = 0; i < sampled.samples.size(); ++i) {
    if (sampled.on_large_plane[i] == 0) continue;
    planes.positions.push_back(sampled.samples.positions[i]);
    planes.normals.push_back(sampled.samples.normals[i]);
    spacings_mm.push_back(sampled.spacings_mm[i]);
  }
  std::vector<std::uint8_t> marks(scan.cloud.size(), 0);
  if (planes.empty()) return marks;
  const KdTree tree(planes.positions);
  const float reach = 1.5F * *std::ranges::max_element(spacings_mm);
  const auto noise = static_cast<float>(scan.noise_sigma_mm);
  constexpr float kAgreeing = 0.9F, kBeside = 1.5F, kRoom = 0.02F;  // spacings the latter two
  parallel_for(context, scan.cloud.size(), 2048, [&](std::size_t i) {
    const KdTree::Neighbour nearest = tree.nearest(scan.cloud.positions[i], reach);
    if (!nearest.found()) return;
    const float spacing = spacings_mm[nearest.index];
    if (nearest.squared_distance > kBeside * kBeside * spacing * spacing) return;
    const Eigen::Vector3f& normal = planes.normals[nearest.index];
    const Eigen::Vector3f offset = scan.cloud.positions[i] - planes.positions[nearest.index];
    const float height = 4.0F * noise + kRoom * spacing;
    marks[i] = std::abs(offset.dot(normal)) <= height && std::abs(normal.dot(scan.cloud.normals[i])) >= kAgreeing;
  });
  return marks;
}

}  // namespace asbuilt::detect
