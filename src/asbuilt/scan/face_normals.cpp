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
constexpr Eigen::Index kSpanning = 8;      // neighbours that span proposals, evenly among all
constexpr float kSameSide = 0.3F;          // cosine: a proposal looks roughly where the given normal does
constexpr float kLargestRefitTurn = 0.7F;  // cosine: a refit that turns further has changed the face

// Neighbours of one point relative to it, nearest first; the point itself left out. Axis by axis, so that sums over
// them are vector instructions: hundreds of planes compete at every point near an edge.
class Neighbourhood {
  // Tukey's weights of the heights above a plane, so that it is judged by what it keeps and not by what it misses.
  [[nodiscard]] auto weights(const Eigen::Vector3f& normal, float limit) const {
    const Eigen::Index n = count();
    const Eigen::Vector3f scaled = normal / limit;
    const auto heights = x_.head(n) * scaled.x() + y_.head(n) * scaled.y() + z_.head(n) * scaled.z();
    return (1.0F - heights.square()).max(0.0F).square();
  }

 public:
  explicit Neighbourhood(std::size_t most)
      : x_(static_cast<Eigen::Index>(most)), y_(x_.size()), z_(x_.size()), weights_(x_.size()) {
    normals_.reserve(most);
  }

  void clear() { normals_.clear(); }

  void add(const Eigen::Vector3f& offset, const Eigen::Vector3f& normal) {
    x_[count()] = offset.x();
    y_[count()] = offset.y();
    z_[count()] = offset.z();
    normals_.push_back(normal);
  }

  [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(normals_.size()); }
  [[nodiscard]] const std::vector<Eigen::Vector3f>& normals() const { return normals_; }
  [[nodiscard]] Eigen::Vector3f offset(Eigen::Index i) const { return {x_[i], y_[i], z_[i]}; }

  // Of the neighbours that a plane through the point keeps: the sum of their weights.
  [[nodiscard]] float kept(const Eigen::Vector3f& normal, float limit) const { return weights(normal, limit).sum(); }

  struct Moments {
    double weight = 0.0;
    Eigen::Vector3d sum;
    Eigen::Matrix3d squares;
  };
  [[nodiscard]] Moments moments(const Eigen::Vector3f& normal, float limit) {
    const Eigen::Index n = count();
    auto w = weights_.head(n);
    const auto x = x_.head(n), y = y_.head(n), z = z_.head(n);
    w = weights(normal, limit);
    Moments result;
    result.weight = static_cast<double>(w.sum());
    result.sum = Eigen::Vector3f((w * x).sum(), (w * y).sum(), (w * z).sum()).cast<double>();
    Eigen::Matrix3f squares;
    squares << (w * x * x).sum(), (w * x * y).sum(), (w * x * z).sum(), 0.0F, (w * y * y).sum(), (w * y * z).sum(),
        0.0F, 0.0F, (w * z * z).sum();
    result.squares = squares.cast<double>().selfadjointView<Eigen::Upper>();
    return result;
  }

 private:
  Eigen::ArrayXf x_, y_, z_;
  Eigen::ArrayXf weights_;  // scratch
  std::vector<Eigen::Vector3f> normals_;
};

// The plane through the point that keeps most, the first of equals.
Eigen::Vector3f best_proposal(const Neighbourhood& around, const Eigen::Vector3f& given, float limit) {
  Eigen::Vector3f best = given;
  float most = around.kept(given, limit);
  const Eigen::Index count = around.count();
  if (most >= kOneFace * static_cast<float>(count)) return best;
  const auto propose = [&](const Eigen::Vector3f& normal) {
    if (normal.dot(given) < kSameSide) return;
    const float support = around.kept(normal, limit);
    if (support > most) {
      most = support;
      best = normal;
    }
  };
  for (const Eigen::Vector3f& normal : around.normals()) propose(normal);
  const Eigen::Index step = std::max<Eigen::Index>(1, count / kSpanning);
  for (Eigen::Index i = step - 1; i < count; i += step) {
    const Eigen::Vector3f first = around.offset(i);
    for (Eigen::Index j = i + step; j < count; j += step) {
      const Eigen::Vector3f second = around.offset(j), across = first.cross(second);
      const float length = across.norm();
      // Neighbours nearly in one line with the point span nothing.
      if (!(length > 0.5F * first.norm() * second.norm())) continue;
      propose((across.dot(given) < 0.0F ? -1.0F : 1.0F) / length * across);
    }
  }
  return best;
}

Eigen::Vector3f refitted(Neighbourhood& around, const Eigen::Vector3f& start, float limit) {
  Eigen::Vector3f normal = start;
  for (int pass = 0; pass < kRefits; ++pass) {
    const Neighbourhood::Moments moments = around.moments(normal, limit);
    const double weight = 1.0 + moments.weight;  // the point itself
    const Eigen::Vector3d mean = moments.sum / weight;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(moments.squares / weight - mean * mean.transpose());
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
    Neighbourhood around(count);
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f& centre = cloud.positions[at[i]];
      tree.nearest(centre, count, neighbours);
      around.clear();
      for (const KdTree::Neighbour& neighbour : neighbours) {
        if (neighbour.index == at[i]) continue;
        around.add(cloud.positions[neighbour.index] - centre, cloud.normals[neighbour.index]);
      }
      if (around.count() < 3) continue;
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
