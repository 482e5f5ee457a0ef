// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "asbuilt/model/surface_distance.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

// The distance to a triangle by another route than ours: minimise over the plane's two coordinates with clamping,
// as a tiny quadratic programme solved by enumeration of its active sets with dense linear algebra.
double distance_by_enumeration(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c) {
  const auto to_segment = [&](const Eigen::Vector3d& q, const Eigen::Vector3d& r) {
    const Eigen::Vector3d d = r - q;
    const double length = d.squaredNorm();
    const double t = length > 0.0 ? std::clamp(d.dot(p - q) / length, 0.0, 1.0) : 0.0;
    return (p - q - t * d).norm();
  };
  double best = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  Eigen::Matrix<double, 3, 2> plane;
  plane << b - a, c - a;
  const Eigen::Vector2d weights = plane.colPivHouseholderQr().solve(p - a);
  if (weights.minCoeff() >= 0.0 && weights.sum() <= 1.0) best = std::min(best, (p - a - plane * weights).norm());
  return best;
}

double brute_force(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
  double best = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    best = std::min(best, distance_by_enumeration(p, at(0), at(1), at(2)));
  }
  return best;
}

TriangleMesh soup(Random& random, int count, double size) {
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d middle = test::random_point(random, -10, 10);
    // Some slivers among them: one axis of the triangle shrinks by up to a million.
    const Eigen::Vector3d squeeze(1.0, std::pow(10.0, random.uniform(-6, 0)), 1.0);
    for (int k = 0; k < 3; ++k) {
      mesh.vertices.push_back(middle + test::random_point(random, -size, size).cwiseProduct(squeeze));
    }
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

TEST(SurfaceDistanceProperty, AgreesWithBruteForceOnRandomSoups) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    Random random(seed, "soup", 0);
    const int count = 1 + static_cast<int>(random.below(300));
    const TriangleMesh mesh = soup(random, count, std::pow(10.0, random.uniform(-2, 1)));
    const SurfaceDistance surface(mesh);
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d p = test::random_point(random, -14, 14);
      const double expected = brute_force(mesh, p);
      const auto nearest = surface.nearest(p);
      ASSERT_NEAR(std::abs(nearest.signed_distance), expected, 1e-9) << "seed " << seed;
      const auto bounded = surface.nearest(p, expected * 1.0001);
      ASSERT_TRUE(bounded.found()) << "seed " << seed;
      ASSERT_EQ(bounded.triangle, nearest.triangle) << "seed " << seed;
      ASSERT_FALSE(surface.nearest(p, expected * 0.9999).found()) << "seed " << seed;
      const auto guessed =
          surface.nearest_from_guess(p, static_cast<std::uint32_t>(random.below(mesh.triangles.size())));
      ASSERT_EQ(guessed.signed_distance, nearest.signed_distance) << "seed " << seed;
      ASSERT_EQ(guessed.triangle, nearest.triangle) << "seed " << seed;
    }
  }
}

TEST(SurfaceDistanceProperty, HoldsFarFromTheOriginToo) {
  Random random(5, "soup", 0);
  TriangleMesh mesh = soup(random, 200, 1.0);
  const Eigen::Vector3d offset(3e6, -2e6, 4e5);
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex += offset;
  const SurfaceDistance surface(mesh);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d p = offset + test::random_point(random, -14, 14);
    // Coordinates of 3e6 leave 5e-10 in a double.
    EXPECT_NEAR(std::abs(surface.nearest(p).signed_distance), brute_force(mesh, p), 1e-7);
  }
}

TEST(SurfaceDistanceProperty, SignTellsInsideFromOutsideOnASphereAndABall) {
  const TriangleMesh mesh = test::sphere({1, 2, 3}, 5.0, 4);
  const SurfaceDistance surface(mesh);
  Random random(7, "sphere", 0);
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p = Eigen::Vector3d(1, 2, 3) + test::random_point(random, -8, 8);
    const double distance = (p - Eigen::Vector3d(1, 2, 3)).norm() - 5.0;
    // The facets cut at most r (1 - cos(half the edge's angle)) off the ball: 0.02 mm at this level.
    ASSERT_NEAR(surface.nearest(p).signed_distance, distance, 0.03);
  }
}

}  // namespace
}  // namespace asbuilt::model
