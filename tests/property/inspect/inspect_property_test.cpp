// SPDX-License-Identifier: Apache-2.0
// Deviations against shapes whose distance is known in closed form, and against brute force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/random.h"
#include "asbuilt/inspect/deviation.h"
#include "support/parts.h"
#include "unit/model/shapes.h"

namespace asbuilt::inspect {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kRadius = 50.0, kEdge = 100.0;
constexpr double kRim = 5.0;     // inside the cube, less far from an edge another side may be the nearest
constexpr double kFloat = 2e-5;  // what a coordinate of some 100 mm loses as a float, mm

model::PreparedModel prepared(const TriangleMesh& mesh) { return model::prepare(mesh, {}, Context(2)).value(); }

const model::PreparedModel& ball() {
  static const model::PreparedModel model = prepared(test::sphere({0, 0, 0}, kRadius, 5));
  return model;
}

const model::PreparedModel& cube() {
  static const model::PreparedModel model = prepared(test::joined(test::box({0, 0, 0}, {kEdge, kEdge, kEdge})));
  return model;
}

/// How far the flat faces of the ball's mesh lie below the true sphere at most.
double sagitta(const TriangleMesh& mesh) {
  double nearest = kRadius;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    nearest = std::min(nearest, (at(1) - at(0)).cross(at(2) - at(0)).normalized().dot(at(0)));
  }
  return kRadius - nearest;
}

Eigen::Vector3d random_direction(Random& random) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return Eigen::Vector3d(x, y, z).normalized();
}

/// Points spread evenly over a sphere about the origin (a Fibonacci lattice, turned at random: without the holes that
/// independent draws leave), as far as they lie within `half_angle` of a random pole.
PointCloud on_cap(double radius, double half_angle, std::size_t count, Random& random) {
  const Eigen::Vector3d pole = random_direction(random);
  const auto turn = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), random_direction(random));
  PointCloud cloud;
  for (std::size_t i = 0; i < count; ++i) {
    const double height = 1.0 - 2.0 * (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double azimuth = kPi * (3.0 - std::sqrt(5.0)) * static_cast<double>(i),
                 around = std::sqrt(1.0 - height * height);
    const Eigen::Vector3d direction =
        turn * Eigen::Vector3d(around * std::cos(azimuth), around * std::sin(azimuth), height);
    if (std::acos(std::clamp(direction.dot(pole), -1.0, 1.0)) > half_angle) continue;
    cloud.positions.emplace_back((radius * direction).cast<float>());
    cloud.normals.emplace_back(direction.cast<float>());
  }
  return cloud;
}

/// A jittered grid over one side of the cube, `height` outside of it; the outermost `rim` is left out.
void add_side(PointCloud& cloud, int axis, bool high, double height, double step, double rim, Random& random) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  for (double a = rim + 0.5 * step; a < kEdge - rim; a += step) {
    for (double b = rim + 0.5 * step; b < kEdge - rim; b += step) {
      Eigen::Vector3d point;
      point[axis] = high ? kEdge + height : -height;
      point[u] = a + random.uniform(-0.3, 0.3) * step;
      point[v] = b + random.uniform(-0.3, 0.3) * step;
      cloud.positions.emplace_back(point.cast<float>());
      cloud.normals.emplace_back((high ? 1.0F : -1.0F) * Eigen::Vector3f::Unit(axis));
    }
  }
}

DeviationReport inspected(const PointCloud& cloud, const model::PreparedModel& model,
                          const InspectOptions& options = {}) {
  return inspect(cloud, model, options, Context(2)).value();
}

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d d = b - a;
  return (p - a - std::clamp(d.dot(p - a) / d.squaredNorm(), 0.0, 1.0) * d).squaredNorm();
}

/// Distance to a closed mesh by asking every triangle; the sign by the solid angle under which it is seen (van Oosterom
/// and Strackee 1983): 4 pi from inside, 0 from outside.
double signed_distance_by_brute_force(const TriangleMesh& mesh, const Eigen::Vector3d& p) {
  double squared = std::numeric_limits<double>::infinity(), solid_angle = 0.0;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto at = [&](int k) { return mesh.vertices[static_cast<std::size_t>(t[k])]; };
    for (int k = 0; k < 3; ++k) squared = std::min(squared, squared_distance_to_segment(p, at(k), at((k + 1) % 3)));
    Eigen::Matrix<double, 3, 2> plane;
    plane << at(1) - at(0), at(2) - at(0);
    const Eigen::Vector2d weights = plane.colPivHouseholderQr().solve(p - at(0));
    if (weights.minCoeff() >= 0.0 && weights.sum() <= 1.0) {
      squared = std::min(squared, (p - at(0) - plane * weights).squaredNorm());
    }
    const Eigen::Vector3d a = at(0) - p, b = at(1) - p, c = at(2) - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    solid_angle += 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return solid_angle > 2.0 * kPi ? -std::sqrt(squared) : std::sqrt(squared);
}

TEST(InspectProperty, ASphereOfAnotherRadiusDeviatesByTheDifferenceEverywhere) {
  const double sag = sagitta(ball().skin);
  ASSERT_LT(sag, 0.1);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed, "sphere", 0);
    const double difference = random.uniform(-3.0, 3.0);
    const PointCloud cloud = on_cap(kRadius + difference, kPi, 4000 + random.below(8000), random);
    const DeviationReport report = inspected(cloud, ball());
    EXPECT_EQ(report.over_points.count, cloud.size()) << "seed " << seed;
    EXPECT_EQ(report.far_points, 0U) << "seed " << seed;
    // The mesh lies on or below the true sphere: a point's deviation is larger by at most the sagitta.
    for (const DeviationStatistics& s : {report.over_points, report.over_area}) {
      EXPECT_GE(s.min, difference - kFloat) << "seed " << seed;
      EXPECT_LE(s.max, difference + sag + kFloat) << "seed " << seed;
      EXPECT_NEAR(s.mean, difference + 0.5 * sag, 0.5 * sag + kFloat) << "seed " << seed;
      EXPECT_NEAR(s.rms, std::abs(s.mean), sag) << "seed " << seed;
      EXPECT_LE(s.sigma, sag) << "seed " << seed;
    }
    EXPECT_GT(report.coverage, 0.999) << "seed " << seed;
  }
}

TEST(InspectProperty, NoiseAndOffsetOfASideComeBackAsSigmaAndMean) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed, "plane", 0);
    const double offset = random.uniform(-2.0, 2.0), sigma = random.uniform(0.01, 0.3);
    PointCloud cloud;
    add_side(cloud, static_cast<int>(random.below(3)), random.uniform() < 0.5, offset, 2.0, kRim, random);
    Eigen::Vector3f normal = cloud.normals.front();
    for (Eigen::Vector3f& point : cloud.positions) point += static_cast<float>(sigma * random.normal()) * normal;
    const DeviationReport report = inspected(cloud, cube());
    const double n = static_cast<double>(cloud.size());  // the bounds are four standard errors
    EXPECT_NEAR(report.over_points.mean, offset, 4.0 * sigma / std::sqrt(n)) << "seed " << seed;
    EXPECT_NEAR(report.over_points.sigma, sigma, 4.0 * sigma / std::sqrt(2.0 * n)) << "seed " << seed;
    if (std::abs(offset) >
        3.0 * sigma) {  // then absolute deviations are normal too; 1.645: the normal's 95th percentile
      EXPECT_NEAR(report.over_points.p95, std::abs(offset) + 1.645 * sigma, 0.2 * sigma) << "seed " << seed;
    }
    EXPECT_LT(report.over_area.sigma, sigma) << "the median over a neighbourhood takes noise out, seed " << seed;
  }
}

TEST(InspectProperty, FiguresOverAreaDoNotDependOnHowDenselyASideWasScanned) {
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed, "density", 0);
    const double first = random.uniform(-2.0, 2.0), second = random.uniform(-2.0, 2.0);
    const double fine = random.uniform(0.8, 1.2), coarse = random.uniform(2.5, 4.0);
    PointCloud cloud;
    add_side(cloud, 2, true, first, fine, kRim, random);
    const auto points_on_first = static_cast<double>(cloud.size());
    add_side(cloud, 0, true, second, coarse, kRim, random);
    const double share = points_on_first / static_cast<double>(cloud.size());
    const DeviationReport report = inspected(cloud, cube());
    EXPECT_NEAR(report.over_points.mean, share * first + (1.0 - share) * second, 1e-3) << "seed " << seed;
    // Both sides are equally large, but for a row of points along two rims (4 of 90 mm) that the grid may leave out.
    // The points alone would weigh the finer side with over 0.8.
    ASSERT_GT(share, 0.8) << "seed " << seed;
    const double slack = 0.1 * std::abs(first - second) + kFloat;
    EXPECT_NEAR(report.over_area.mean, 0.5 * (first + second), slack) << "seed " << seed;
    EXPECT_NEAR(report.over_area.sigma, 0.5 * std::abs(first - second), slack) << "seed " << seed;
  }
}

TEST(InspectProperty, AgreesWithBruteForceOnRandomPointsAboutAPart) {
  const TriangleMesh mesh = test::stepped_block();
  const model::PreparedModel model = prepared(mesh);
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed, "brute force", 0);
    InspectOptions options;
    options.max_distance_ratio = random.uniform(0.02, 0.2);
    options.tolerance = Tolerance{random.uniform(-6.0, 0.0), random.uniform(0.0, 6.0)};
    PointCloud cloud;
    for (int i = 0; i < 600; ++i) {
      const Eigen::Vector3d share = test::random_point(random, -0.2, 1.2);
      cloud.positions.emplace_back((box.min() + share.cwiseProduct(box.sizes())).cast<float>());
    }
    const DeviationReport report = inspected(cloud, model, options);
    std::vector<double> near;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const double expected = signed_distance_by_brute_force(mesh, cloud.positions[i].cast<double>());
      ASSERT_NEAR(report.deviation_mm[i], expected, kFloat) << "seed " << seed << ", point " << i;
      if (std::abs(expected) <= options.max_distance_ratio * model.diameter) near.push_back(expected);
    }
    const auto count = static_cast<double>(near.size());
    double sum = 0.0, squares = 0.0, within = 0.0, over = 0.0;
    for (const double d : near) {
      sum += d, squares += d * d;
      within += options.tolerance->low_mm <= d && d <= options.tolerance->high_mm ? 1.0 : 0.0;
      over += d > options.tolerance->high_mm ? 1.0 : 0.0;
    }
    const DeviationStatistics& s = report.over_points;
    EXPECT_EQ(s.count, near.size()) << "seed " << seed;
    EXPECT_EQ(report.far_points, cloud.size() - near.size()) << "seed " << seed;
    EXPECT_NEAR(s.min, *std::ranges::min_element(near), kFloat) << "seed " << seed;
    EXPECT_NEAR(s.max, *std::ranges::max_element(near), kFloat) << "seed " << seed;
    EXPECT_NEAR(s.mean, sum / count, kFloat) << "seed " << seed;
    EXPECT_NEAR(s.rms, std::sqrt(squares / count), kFloat) << "seed " << seed;
    EXPECT_NEAR(s.sigma, std::sqrt(squares / count - sum / count * (sum / count)), 1e-4) << "seed " << seed;
    EXPECT_NEAR(s.in_tolerance.value(), within / count, 1e-9) << "seed " << seed;
    EXPECT_NEAR(s.over_tolerance.value(), over / count, 1e-9) << "seed " << seed;
    EXPECT_NEAR(*s.in_tolerance + *s.over_tolerance + *s.under_tolerance, 1.0, 1e-9) << "seed " << seed;
  }
}

// Grey, never green: what no point lies next to has no deviation, and no tolerance speaks for it.
TEST(InspectProperty, CoverageIsTheShareOfTheCapThatWasScanned) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Random random(seed, "cap", 0);
    const double half_angle = random.uniform(0.3, 2.6), difference = random.uniform(-1.0, 1.0);
    InspectOptions options;
    options.tolerance = Tolerance{-2.0, 2.0};
    const PointCloud cloud = on_cap(kRadius + difference, half_angle, 60000, random);
    const DeviationReport report = inspected(cloud, ball(), options);
    // A sample counts as scanned up to one sample spacing (the cloud is finer) beyond the rim.
    const auto samples = static_cast<double>(ball().dense_samples.size());
    const double spacing_angle = std::sqrt(4.0 * kPi / samples);
    const auto cap = [](double angle) { return 0.5 * (1.0 - std::cos(std::clamp(angle, 0.0, kPi))); };
    EXPECT_GE(report.coverage, cap(half_angle - 0.5 * spacing_angle) - 0.01) << "seed " << seed;
    EXPECT_LE(report.coverage, cap(half_angle + 1.5 * spacing_angle) + 0.01) << "seed " << seed;
    EXPECT_EQ(report.over_area.count, static_cast<std::size_t>(std::lround(report.coverage * samples)));
    EXPECT_DOUBLE_EQ(report.over_area.in_tolerance.value(), 1.0) << "a share of what was scanned, seed " << seed;
  }
}

TEST(InspectProperty, MorePointsNeverTakeCoverageAway) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Random random(seed, "growing", 0);
    // Equal spacing throughout, so that the reach of a point stays the same; sides are added one by one.
    PointCloud cloud;
    double coverage = 0.0;
    for (const int side : {0, 1, 2, 3, 4, 5}) {
      add_side(cloud, side / 2, side % 2 == 1, random.uniform(0.0, 1.0), 1.5, 0.0, random);
      const DeviationReport report = inspected(cloud, cube());
      EXPECT_GE(report.coverage, coverage) << "seed " << seed << ", side " << side;
      EXPECT_NEAR(report.coverage, (side + 1) / 6.0, 0.02) << "seed " << seed << ", side " << side;
      coverage = report.coverage;
    }
  }
}

// The outermost rows lie most of a spacing away from the edges. Where the scan goes on beyond the edge that is no rim;
// where it does not, a rim reaches half a spacing further than the points.
TEST(InspectProperty, AScanThatGoesRoundTheEdgesLeavesNoGreyAlongThem) {
  constexpr double kStep = 2.0, kFromEdge = 0.8 * kStep;
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Random random(seed, "edges", 0);
    PointCloud all, top;
    for (int side = 0; side < 6; ++side) {
      add_side(all, side / 2, side % 2 == 1, 0.0, kStep, kFromEdge - 0.5 * kStep, random);
    }
    add_side(top, 2, true, 0.0, kStep, kFromEdge - 0.5 * kStep, random);
    EXPECT_GE(inspected(all, cube()).coverage, 0.99) << "seed " << seed;
    const auto share = [&](double beyond) {  // of the square that reaches so far out of the last rows
      return std::pow((kEdge - 2.0 * (kFromEdge - beyond)) / kEdge, 2) / 6.0;
    };
    const double coverage = inspected(top, cube()).coverage;
    EXPECT_GE(coverage, share(0.0)) << "seed " << seed;
    EXPECT_LE(coverage, share(0.6 * kStep)) << "seed " << seed;
  }
}

TEST(InspectProperty, OneWallOfAThinPlateSaysNothingAboutTheOther) {
  for (const double thickness : {0.4, 1.0, 3.0}) {
    const model::PreparedModel plate = prepared(test::joined(test::box({0, 0, 0}, {kEdge, kEdge, thickness}, 8)));
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      Random random(seed, "plate", 0);
      PointCloud top;
      add_side(top, 2, true, 0.0, 1.5, 0.0, random);
      // Noise as large as half the wall: the other wall is often nearer.
      for (Eigen::Vector3f& p : top.positions) {
        p.z() = static_cast<float>(thickness + 0.5 * thickness * std::clamp(random.normal(), -1.5, 1.5));
      }
      const DeviationReport report = inspected(top, plate);
      const double whole = 2.0 * kEdge * kEdge + 4.0 * kEdge * thickness;
      // The top, and of the narrow rim what lies within a spacing of it.
      EXPECT_LE(report.coverage, (kEdge * kEdge + 4.0 * kEdge * thickness) / whole + 0.01)
          << thickness << " mm, seed " << seed;
      EXPECT_GE(report.coverage, 0.95 * kEdge * kEdge / whole) << thickness << " mm, seed " << seed;
    }
  }
}

}  // namespace
}  // namespace asbuilt::inspect
