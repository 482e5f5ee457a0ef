// SPDX-License-Identifier: Apache-2.0
// The search for many points at once against the search for each, which its own tests hold against brute force.
#include <gtest/gtest.h>

#include <limits>

#include "asbuilt/model/surface_search.h"
#include "unit/model/shapes.h"

namespace asbuilt::model {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Triangles of very different sizes, slivers among them, each about a middle within 10 of the origin.
TriangleMesh soup(Random& random, int count) {
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d middle = test::random_point(random, -10, 10);
    const double size = std::pow(10.0, random.uniform(-2, 1.5));
    const Eigen::Vector3d squeeze(1.0, std::pow(10.0, random.uniform(-12, 0)), 1.0);
    for (int k = 0; k < 3; ++k) {
      mesh.vertices.push_back(middle + test::random_point(random, -size, size).cwiseProduct(squeeze));
    }
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

std::vector<Eigen::Vector3d> cluster_about(const Eigen::Vector3d& middle, double size, std::size_t count,
                                           Random& random) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) points.push_back(middle + test::random_point(random, -size, size));
  return points;
}

/// Squared distance to a triangle, in long double and by another route: the foot in barycentric coordinates, else the
/// best side.
long double squared_distance(const Eigen::Vector3d& point, const TriangleMesh& mesh, std::size_t triangle) {
  using Vector = Eigen::Matrix<long double, 3, 1>;
  const auto at = [&](int k) -> Vector {
    return mesh.vertices[static_cast<std::size_t>(mesh.triangles[triangle][k])].cast<long double>();
  };
  const Vector p = point.cast<long double>(), u = at(1) - at(0), v = at(2) - at(0), w = p - at(0);
  const long double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), determinant = uu * vv - uv * uv;
  long double best = std::numeric_limits<long double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector a = at(k), side = at((k + 1) % 3) - a;
    const long double length = side.squaredNorm();
    const long double t = length > 0.0L ? std::clamp(side.dot(p - a) / length, 0.0L, 1.0L) : 0.0L;
    best = std::min(best, (p - a - t * side).squaredNorm());
  }
  if (!(determinant > 0.0L)) return best;
  const long double s = (vv * u.dot(w) - uv * v.dot(w)) / determinant;
  const long double t = (uu * v.dot(w) - uv * u.dot(w)) / determinant;
  if (s >= 0.0L && t >= 0.0L && s + t <= 1.0L) best = std::min(best, (w - s * u - t * v).squaredNorm());
  return best;
}

void expect_same_as_one_by_one(const SurfaceSearch& search, const std::vector<Eigen::Vector3d>& points,
                               const std::string& where) {
  const auto found = search.nearest_of_cluster(points);
  ASSERT_EQ(found.size(), points.size()) << where;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto alone = search.nearest(points[i], kInfinity);
    ASSERT_EQ(found[i].signed_distance, alone.signed_distance) << where << ", point " << i;
    ASSERT_EQ(found[i].triangle, alone.triangle) << where << ", point " << i;
    ASSERT_EQ(found[i].point, alone.point) << where << ", point " << i;
    ASSERT_EQ(found[i].on_open_edge, alone.on_open_edge) << where << ", point " << i;
  }
}

TEST(SurfaceSearchProperty, ClustersInSoupsOfAllSizesFindWhatBruteForceFinds) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, "soup", 0);
    const TriangleMesh mesh = soup(random, 1 + static_cast<int>(random.below(60)));
    const SurfaceSearch search(mesh);
    for (int k = 0; k < 6; ++k) {
      const double size = std::pow(10.0, random.uniform(-3, 1));
      const auto points = cluster_about(test::random_point(random, -14, 14), size, 1 + random.below(60), random);
      const std::string where = "seed " + std::to_string(seed) + ", cluster " + std::to_string(k);
      expect_same_as_one_by_one(search, points, where);
      const auto found = search.nearest_of_cluster(points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        long double least = std::numeric_limits<long double>::infinity();
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
          least = std::min(least, squared_distance(points[i], mesh, t));
        }
        ASSERT_NEAR(std::abs(found[i].signed_distance), static_cast<double>(std::sqrt(least)), 1e-9) << where;
      }
    }
  }
}

TEST(SurfaceSearchProperty, ClustersOnASphereOfManyTrianglesFindTheSameAsEachPoint) {
  // From a handful of triangles about a cluster to more than are looked at together.
  const SurfaceSearch search(test::sphere({100, -200, 300}, 50.0, 5));
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed, "sphere", 0);
    const Eigen::Vector3d direction = test::random_point(random, -1, 1).normalized();
    const double height = 50.0 + random.normal() * std::pow(10.0, random.uniform(-4, 1));
    const auto points = cluster_about(Eigen::Vector3d(100, -200, 300) + height * direction,
                                      std::pow(10.0, random.uniform(-3, 1)), 40, random);
    expect_same_as_one_by_one(search, points, "seed " + std::to_string(seed));
  }
}

TEST(SurfaceSearchProperty, TiesOnEdgesAndCornersGoTheSameWay) {
  const SurfaceSearch search(test::joined(test::box({-1, -1, -1}, {1, 1, 1}, 2)));
  std::vector<Eigen::Vector3d> points;
  for (int x = -8; x <= 8; ++x) {
    for (int y = -8; y <= 8; ++y) {
      for (int z = -8; z <= 8; ++z) points.emplace_back(0.25 * x, 0.25 * y, 0.25 * z);
    }
  }
  expect_same_as_one_by_one(search, points, "all");
  for (std::size_t i = 0; i + 17 <= points.size(); i += 17) {
    const auto first = points.begin() + static_cast<std::ptrdiff_t>(i);
    expect_same_as_one_by_one(search, {first, first + 17}, "row " + std::to_string(i / 17));
  }
}

TEST(SurfaceSearchProperty, HoldsFarFromTheOrigin) {
  Random random(5, "soup", 0);
  TriangleMesh mesh = soup(random, 60);
  const Eigen::Vector3d offset(3e6, -2e6, 4e5);
  for (Eigen::Vector3d& vertex : mesh.vertices) vertex += offset;
  const SurfaceSearch search(mesh);
  for (int k = 0; k < 50; ++k) {
    const auto points = cluster_about(offset + test::random_point(random, -14, 14), 0.5, 30, random);
    expect_same_as_one_by_one(search, points, "cluster " + std::to_string(k));
  }
}

TEST(SurfaceSearch, FindsNothingForNoPointsNoTrianglesAndPointsThatAreNotFinite) {
  const SurfaceSearch empty{TriangleMesh{}};
  const std::vector<Eigen::Vector3d> points(20, Eigen::Vector3d(1, 2, 3));
  for (const auto& nearest : empty.nearest_of_cluster(points)) EXPECT_FALSE(nearest.found());
  const SurfaceSearch search(test::box({0, 0, 0}, {1, 1, 1}));
  EXPECT_TRUE(search.nearest_of_cluster({}).empty());
  std::vector<Eigen::Vector3d> with_hole = points;
  with_hole[7].y() = std::numeric_limits<double>::quiet_NaN();
  const auto found = search.nearest_of_cluster(with_hole);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i].found(), i != 7) << i;
}

}  // namespace
}  // namespace asbuilt::model
