// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/face_normals.h"

#include <gmock/gmock.h>

#include <cmath>

#include "asbuilt/core/random.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/scan/normals.h"

namespace asbuilt::scan {
namespace {

// Three points across each face of a square bar along x: a thin profile as a distant scanner sees it. `across` tells
// the two faces apart: y = 0 facing -y, z = 0 facing -z, the edge between them along x.
struct Bar {
  PointCloud cloud;
  std::vector<Eigen::Vector3f> truth;
};

Bar thin_bar(double spacing, double sigma) {
  Bar bar;
  Random random(3, "bar", 0);
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double x = spacing * (i + random.uniform(-0.3, 0.3));
      const double across = spacing * (j + 0.5 + random.uniform(-0.3, 0.3)), noise = sigma * random.normal();
      bar.cloud.positions.push_back(Eigen::Vector3d(x, noise, across).cast<float>());
      bar.truth.push_back(-Eigen::Vector3f::UnitY());
      bar.cloud.positions.push_back(Eigen::Vector3d(x, across, noise).cast<float>());
      bar.truth.push_back(-Eigen::Vector3f::UnitZ());
    }
  }
  return bar;
}

double share_within(const std::vector<Eigen::Vector3f>& normals, const Bar& bar, double radians) {
  std::size_t good = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    good += normals[i].dot(bar.truth[i]) > std::cos(radians) ? 1 : 0;
  }
  return static_cast<double>(good) / static_cast<double>(normals.size());
}

TEST(FaceNormals, OfAThinProfileAreThoseOfItsFaces) {
  const double spacing = 10.0, sigma = 0.4;
  Bar bar = thin_bar(spacing, sigma);
  const KdTree tree(bar.cloud.positions);
  bar.cloud.normals =
      scan::fitted_normals(bar.cloud.positions, tree, spacing, scan::neighbours_for_normals(sigma, spacing), Context(2))
          .normals;
  const Eigen::Vector3f outwards = -(Eigen::Vector3f::UnitY() + Eigen::Vector3f::UnitZ());
  for (Eigen::Vector3f& normal : bar.cloud.normals) {
    if (normal.dot(outwards) < 0.0F) normal = -normal;
  }
  // Noise alone tilts a fit over 12 points 10 mm apart by some 0.02 rad; 0.15 rad leaves room for fits at the ends.
  ASSERT_LT(share_within(bar.cloud.normals, bar, 0.15), 0.6) << "planes over all neighbours blend the faces";
  const auto normals = face_normals(bar.cloud, tree, sigma, spacing, Context(2));
  EXPECT_GT(share_within(normals, bar, 0.15), 0.9);
  for (const Eigen::Vector3f& normal : normals) EXPECT_NEAR(normal.norm(), 1.0F, 1e-5F);
  EXPECT_EQ(normals, face_normals(bar.cloud, tree, sigma, spacing, Context(1)));
}

TEST(FaceNormals, OfAFlatFaceStayWhatTheyAre) {
  PointCloud plane;
  for (int i = 0; i < 30; ++i) {
    for (int j = 0; j < 30; ++j) plane.positions.emplace_back(static_cast<float>(i), static_cast<float>(j), 0.0F);
  }
  plane.normals.assign(plane.size(), Eigen::Vector3f::UnitZ());
  const KdTree tree(plane.positions);
  for (const Eigen::Vector3f& normal : face_normals(plane, tree, 0.01, 1.0, Context(1))) {
    EXPECT_GT(normal.z(), 0.99999F);
  }
}

TEST(FaceNormals, OfHardlyAnyPointsAreThoseGiven) {
  PointCloud two;
  two.positions = {Eigen::Vector3f::Zero(), Eigen::Vector3f::UnitX()};
  two.normals = {Eigen::Vector3f::UnitZ(), Eigen::Vector3f::UnitZ()};
  const KdTree tree(two.positions);
  EXPECT_EQ(face_normals(two, tree, 0.1, 1.0, Context(1)), two.normals);
  EXPECT_TRUE(face_normals({}, KdTree({}), 0.1, 1.0, Context(1)).empty());
}

}  // namespace
}  // namespace asbuilt::scan
