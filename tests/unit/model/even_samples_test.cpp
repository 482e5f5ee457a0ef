// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/model/prepared_model.h"
#include "asbuilt/model/sample_normals.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

const Context kContext(2);

std::vector<double> neighbour_distances(const PointCloud& cloud) {
  const KdTree tree(cloud.positions);
  std::vector<double> distances;
  std::vector<KdTree::Neighbour> two;
  for (const Eigen::Vector3f& point : cloud.positions) {
    tree.nearest(point, 2, two);
    distances.push_back(std::sqrt(static_cast<double>(two[1].squared_distance)));
  }
  std::ranges::sort(distances);
  return distances;
}

TEST(EvenSamples, KeepTheirDistanceAndLeaveNoGaps) {
  const TriangleMesh mesh = test::sphere({0, 0, 0}, 50.0, 5);
  const double spacing = 5.0;
  const PointCloud samples = even_samples(mesh, spacing, 1, kContext);
  const std::vector<double> distances = neighbour_distances(samples);
  EXPECT_GE(distances.front(), 0.849 * spacing);
  EXPECT_NEAR(distances[distances.size() / 2], spacing, 0.15 * spacing);
  const KdTree tree(samples.positions);
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    const auto nearest = tree.nearest(vertex.cast<float>());
    ASSERT_LT(std::sqrt(nearest.squared_distance), 1.15 * spacing);
  }
}

TEST(EvenSamples, ShareTheSphereByArea) {
  // By Archimedes' theorem z is uniform on a sphere. Even samples vary less than independent ones.
  const PointCloud samples = even_samples(test::sphere({0, 0, 0}, 50.0, 5), 3.0, 1, kContext);
  std::array<int, 10> slices{};
  for (const Eigen::Vector3f& p : samples.positions) {
    ++slices[static_cast<std::size_t>(std::clamp((p.z() + 50.0F) / 10.0F, 0.0F, 9.0F))];
  }
  const double expected = static_cast<double>(samples.size()) / 10.0;
  for (const int count : slices) EXPECT_NEAR(count, expected, 2.5 * std::sqrt(expected));
}

TEST(EvenSamples, DoNotDependOnHowTheSurfaceIsCut) {
  // The same box in 12 and in 1200 triangles, one face of it in slivers: counts per face agree.
  const double spacing = 2.0;
  const auto on_top = [&](const TriangleMesh& mesh) {
    const PointCloud samples = even_samples(mesh, spacing, 1, kContext);
    return static_cast<double>(std::ranges::count_if(samples.normals, [](const auto& n) { return n.z() > 0.5F; }));
  };
  const double coarse = on_top(test::box({0, 0, 0}, {40, 40, 40}));
  const double fine = on_top(test::box({0, 0, 0}, {40, 40, 40}, 10));
  EXPECT_NEAR(coarse, fine, 0.1 * coarse);
}

TEST(EvenSamples, SampleBothSidesOfAThinWallInFull) {
  const double spacing = 4.0;
  const auto on_top = [&](double thickness) {
    const PointCloud samples = even_samples(test::box({0, 0, 0}, {100, 100, thickness}), spacing, 1, kContext);
    return static_cast<double>(std::ranges::count_if(samples.normals, [](const auto& n) { return n.z() > 0.5F; }));
  };
  // If the sides competed, each would get half. A little more than the thick box's top is right: there the samples of
  // the side walls keep some distance along the edges.
  EXPECT_GT(on_top(0.5), 0.95 * on_top(50.0));
  EXPECT_LT(on_top(0.5), 1.2 * on_top(50.0));
}

TEST(EvenSamples, LieOnTheSurfaceWithTheNormalOfTheirFace) {
  const PointCloud samples = even_samples(test::box({0, 0, 0}, {10, 20, 30}), 2.0, 1, kContext);
  ASSERT_EQ(samples.normals.size(), samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    int axis = 0;
    ASSERT_NEAR(samples.normals[i].cwiseAbs().maxCoeff(&axis), 1.0F, 1e-6F);
    const float side = samples.normals[i][axis] > 0.0F ? 10.0F * static_cast<float>(axis + 1) : 0.0F;
    ASSERT_NEAR(samples.positions[i][axis], side, 1e-5F);
  }
}

TEST(EvenSamples, AreTheSameForAnyNumberOfThreadsAndDifferForAnotherSeed) {
  const TriangleMesh mesh = test::sphere({0, 0, 0}, 50.0, 4);
  const PointCloud one = even_samples(mesh, 4.0, 1, Context(1));
  for (const int threads : {2, 3}) {
    const PointCloud other = even_samples(mesh, 4.0, 1, Context(threads));
    EXPECT_EQ(other.positions, one.positions);
    EXPECT_EQ(other.normals, one.normals);
  }
  EXPECT_NE(even_samples(mesh, 4.0, 2, Context(1)).positions, one.positions);
}

TEST(EvenSamples, AreSpreadOutFromTheFirstOn) {
  const PointCloud samples = even_samples(test::sphere({0, 0, 0}, 50.0, 5), 3.0, 1, kContext);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const std::size_t few = samples.size() / 10;
  for (std::size_t i = 0; i < few; ++i) mean += samples.positions[i].cast<double>() / static_cast<double>(few);
  EXPECT_LT(mean.norm(), 4.0 * 50.0 / std::sqrt(3.0 * static_cast<double>(few)));  // four standard errors
}

TEST(EvenSamples, OfNothingAreNone) {
  EXPECT_TRUE(even_samples(TriangleMesh{}, 1.0, 1, kContext).empty());
  TriangleMesh flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}};
  EXPECT_TRUE(even_samples(flat, 1.0, 1, kContext).empty());
  EXPECT_THROW((void)even_samples(flat, 0.0, 1, kContext), std::logic_error);
}

TEST(EvenSamples, OfASpacingWiderThanTheMeshAreAtLeastOne) {
  EXPECT_GE(even_samples(test::box({0, 0, 0}, {1, 1, 1}), 100.0, 1, kContext).size(), 1U);
}

TEST(FittedNormals, FollowTheSphereBetterThanItsFacets) {
  const TriangleMesh mesh = test::sphere({0, 0, 0}, 50.0, 2);  // coarse facets, 128 of them
  const PointCloud samples = even_samples(mesh, 12.0, 1, kContext), dense = even_samples(mesh, 3.0, 2, kContext);
  const std::vector<Eigen::Vector3f> normals = fitted_normals(samples, dense, 12.0, kContext);
  double fitted_error = 0.0, facet_error = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Vector3f truth = samples.positions[i].normalized();
    fitted_error += static_cast<double>((normals[i] - truth).squaredNorm());
    facet_error += static_cast<double>((samples.normals[i] - truth).squaredNorm());
    ASSERT_NEAR(normals[i].norm(), 1.0F, 1e-5F);
  }
  EXPECT_LT(fitted_error, 0.5 * facet_error);
}

TEST(FittedNormals, DoNotMixTheTwoSidesOfAThinPlate) {
  const TriangleMesh plate = test::box({0, 0, 0}, {100, 100, 1});
  const PointCloud samples = even_samples(plate, 6.0, 1, kContext), dense = even_samples(plate, 2.0, 2, kContext);
  const std::vector<Eigen::Vector3f> normals = fitted_normals(samples, dense, 6.0, kContext);
  for (std::size_t i = 0; i < samples.size(); ++i) ASSERT_GT(normals[i].dot(samples.normals[i]), 0.9999F);
}

}  // namespace
}  // namespace asbuilt::model
