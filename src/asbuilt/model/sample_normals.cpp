// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/sample_normals.h"

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::model {
namespace {

constexpr float kSameSide = 0.1F;      // cosine; a little above zero, so that a square edge's other face stays out
constexpr double kFlatAcross = 1e-3;   // middle / largest spread: below, the points are a line and have no plane
constexpr double kMinAgreement = 0.5;  // cosine to the face normal: a fit further off describes something else

Eigen::Vector3d plane_normal(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& face_normal) {
  if (points.size() < 4) return face_normal;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) mean += point;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points) spread += (point - mean) * (point - mean).transpose();
  const SymmetricEigen<3> solver(spread);
  if (!(solver.eigenvalues()[1] > kFlatAcross * solver.eigenvalues()[2])) return face_normal;
  const Eigen::Vector3d normal = solver.eigenvectors().col(0);
  const double agreement = normal.dot(face_normal);
  if (std::abs(agreement) < kMinAgreement) return face_normal;
  return agreement < 0.0 ? Eigen::Vector3d(-normal) : normal;
}

}  // namespace

std::vector<Eigen::Vector3f> fitted_normals(const PointCloud& samples, const PointCloud& dense, double radius_mm,
                                            const Context& context) {
  const KdTree tree(dense.positions);
  std::vector<Eigen::Vector3f> normals(samples.size());
  parallel_for_blocks(context, samples.size(), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<KdTree::Neighbour> neighbours;
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = begin; i < end; ++i) {
      tree.within(samples.positions[i], static_cast<float>(radius_mm), neighbours);
      points.clear();
      for (const KdTree::Neighbour& neighbour : neighbours) {
        if (dense.normals[neighbour.index].dot(samples.normals[i]) < kSameSide) continue;
        // About the sample: large coordinates would drown the spread.
        points.emplace_back((dense.positions[neighbour.index] - samples.positions[i]).cast<double>());
      }
      normals[i] = plane_normal(points, samples.normals[i].cast<double>()).cast<float>();
    }
  });
  return normals;
}

}  // namespace asbuilt::model
