// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/face_normals.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "asbuilt/core/parallel.h"
#include "asbuilt/scan/normals.h"

namespace asbuilt::scan {
namespace {

constexpr int kRefits = 3;
constexpr double kLimitInSigmas = 4.0;     // neighbours further off a plane are of another face
constexpr float kOneFace = 0.8F;           // share of the neighbours that the given plane keeps far from any edge
constexpr std::size_t kSpanning = 8;       // neighbours that span proposals, evenly among all
constexpr float kSameSide = 0.3F;          // cosine: a proposal looks roughly where the given normal does
constexpr float kLargestRefitTurn = 0.7F;  // cosine: a refit that turns further has changed the face

// Neighbours of one point relative to it, nearest first; the point itself left out.
struct Neighbourhood {
  std::vector<Eigen::Vector3f> offsets;
  std::vector<Eigen::Vector3f> normals;
};

// Tukey's weight of a height, so that a plane is judged by what it keeps and not by what it misses.
float kept_weight(float height_in_limits) {
  const float left = std::max(0.0F, 1.0F - height_in_limits * height_in_limits);
  return left * left;
}

float kept(const Neighbourhood& around, const Eigen::Vector3f& normal, float limit) {
  float sum = 0.0F;
  for (const Eigen::Vector3f& offset : around.offsets) sum += kept_weight(normal.dot(offset) / limit);
  return sum;
}

// The plane through the point that keeps most, the first of equals.
Eigen::Vector3f best_proposal(const Neighbourhood& around, const Eigen::Vector3f& given, float limit) {
  Eigen::Vector3f best = given;
  float most = kept(around, given, limit);
  const std::size_t count = around.offsets.size();
  if (most >= kOneFace * static_cast<float>(count)) return best;
  const auto propose = [&](const Eigen::Vector3f& normal) {
    if (normal.dot(given) < kSameSide) return;
    const float support = kept(around, normal, limit);
    if (support > most) {
      most = support;
      best = normal;
    }
  };
  for (const Eigen::Vector3f& normal : around.normals) propose(normal);
  const std::size_t step = std::max<std::size_t>(1, count / kSpanning);
  for (std::size_t i = step - 1; i < count; i += step) {
    for (std::size_t j = i + step; j < count; j += step) {
      const Eigen::Vector3f across = around.offsets[i].cross(around.offsets[j]);
      const float length = across.norm();
      // Neighbours nearly in one line with the point span nothing.
      if (!(length > 0.5F * around.offsets[i].norm() * around.offsets[j].norm())) continue;
      propose((across.dot(given) < 0.0F ? -1.0F : 1.0F) / length * across);
    }
  }
  return best;
}

Eigen::Vector3f refitted(const Neighbourhood& around, const Eigen::Vector3f& start, float limit) {
  Eigen::Vector3f normal = start;
  for (int pass = 0; pass < kRefits; ++pass) {
    double weights = 1.0;  // the point itself
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3f& offset : around.offsets) {
      const auto weight = static_cast<double>(kept_weight(normal.dot(offset) / limit));
      if (weight <= 0.0) continue;
      const Eigen::Vector3d x = offset.cast<double>();
      weights += weight;
      sum += weight * x;
      moments += weight * x * x.transpose();
    }
    moments = moments / weights - (sum / weights) * (sum / weights).transpose();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(moments);
    Eigen::Vector3f fitted = eigen.eigenvectors().col(0).cast<float>();
    if (!fitted.allFinite() || !(eigen.eigenvalues()[1] > 0.0)) return normal;
    if (fitted.dot(start) < 0.0F) fitted = -fitted;
    if (fitted.dot(start) < kLargestRefitTurn) return normal;
    normal = fitted.normalized();
  }
  return normal;
}

}  // namespace

std::vector<Eigen::Vector3f> face_normals_at(std::span<const std::uint32_t> at, const PointCloud& cloud,
                                             const KdTree& tree, double noise_sigma_mm, double spacing_mm,
                                             const Context& context) {
  std::vector<Eigen::Vector3f> normals(at.size());
  for (std::size_t i = 0; i < at.size(); ++i) normals[i] = cloud.normals[at[i]];
  if (!(spacing_mm > 0.0)) return normals;
  const double noise = std::max(noise_sigma_mm, 1e-3 * spacing_mm);
  const std::size_t count = neighbours_for_normals(noise, spacing_mm) + 1;  // and the point itself
  const auto limit = static_cast<float>(kLimitInSigmas * noise);
  parallel_for_blocks(context, at.size(), 256, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    Neighbourhood around;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f& centre = cloud.positions[at[i]];
      tree.nearest(centre, count, neighbours);
      around.offsets.clear();
      around.normals.clear();
      for (const KdTree::Neighbour& neighbour : neighbours) {
        if (neighbour.index == at[i]) continue;
        around.offsets.push_back(cloud.positions[neighbour.index] - centre);
        around.normals.push_back(cloud.normals[neighbour.index]);
      }
      if (around.offsets.size() < 3) continue;
      normals[i] = refitted(around, best_proposal(around, normals[i], limit), limit);
    }
  });
  return normals;
}

std::vector<Eigen::Vector3f> face_normals(const PointCloud& cloud, const KdTree& tree, double noise_sigma_mm,
                                          double spacing_mm, const Context& context) {
  std::vector<std::uint32_t> all(cloud.size());
  std::iota(all.begin(), all.end(), 0U);
  return face_normals_at(all, cloud, tree, noise_sigma_mm, spacing_mm, context);
}

}  // namespace asbuilt::scan
