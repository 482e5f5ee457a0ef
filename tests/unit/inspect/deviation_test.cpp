// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/deviation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "asbuilt/core/random.h"

namespace asbuilt::inspect {
namespace {

constexpr double kEdge = 100.0;

/// A cube [0, 100]^3, wound outwards.
const model::PreparedModel& cube() {
  static const model::PreparedModel model = [] {
    TriangleMesh mesh;
    for (int i = 0; i < 8; ++i) mesh.vertices.emplace_back(kEdge * (i & 1), kEdge * (i >> 1 & 1), kEdge * (i >> 2 & 1));
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return model::prepare(mesh, {}, Context(2)).value();
  }();
  return model;
}

/// A grid of points over the cube's top, `height_mm(x, y)` above it, with normals up.
template <class Height>
PointCloud over_top(double step_mm, const Height& height_mm) {
  PointCloud cloud;
  for (double x = 0.5 * step_mm; x < kEdge; x += step_mm) {
    for (double y = 0.5 * step_mm; y < kEdge; y += step_mm) {
      cloud.positions.emplace_back(Eigen::Vector3d(x, y, kEdge + height_mm(x, y)).cast<float>());
      cloud.normals.emplace_back(Eigen::Vector3f::UnitZ());
    }
  }
  return cloud;
}

DeviationReport inspected(const PointCloud& cloud, const InspectOptions& options = {}, int threads = 2) {
  return inspect(cloud, cube(), options, Context(threads)).value();
}

TEST(Inspect, MeasuresAParallelPlaneExactlyAndPositiveOutside) {
  const DeviationReport outside = inspected(over_top(1.0, [](double, double) { return 0.25; }));
  EXPECT_NEAR(outside.over_points.mean, 0.25, 1e-5);  // float coordinates of 100 mm
  EXPECT_NEAR(outside.over_points.sigma, 0.0, 1e-5);
  EXPECT_NEAR(outside.over_area.mean, 0.25, 1e-5);
  const DeviationReport inside = inspected(over_top(1.0, [](double, double) { return -0.25; }));
  EXPECT_NEAR(inside.over_points.mean, -0.25, 1e-5);
}

TEST(Inspect, CountsOneScannedSideOfSixAsASixthOfTheSurface) {
  const DeviationReport report = inspected(over_top(1.0, [](double, double) { return 0.0; }));
  EXPECT_NEAR(report.coverage, 1.0 / 6.0, 0.005);  // samples on the rim belong to one side or the other
}

TEST(Inspect, DoesNotLetDensityOutvoteArea) {
  // One half of the top is 1 mm high and scanned once, the other is 0 and scanned nine times as densely.
  PointCloud cloud = over_top(1.0, [](double, double) { return 1.0; });
  std::erase_if(cloud.positions, [](const Eigen::Vector3f& p) { return p.x() > 50.0F; });
  for (const Eigen::Vector3f& p : over_top(1.0 / 3.0, [](double, double) { return 0.0; }).positions) {
    if (p.x() > 50.0F) cloud.positions.push_back(p);
  }
  cloud.normals.assign(cloud.positions.size(), Eigen::Vector3f::UnitZ());
  const DeviationReport report = inspected(cloud);
  EXPECT_NEAR(report.over_points.mean, 0.1, 0.01);
  EXPECT_NEAR(report.over_area.mean, 0.5, 0.02);
}

TEST(Inspect, GivesTheShareOfAPlantedDent) {
  // A dent 2 mm deep across the middle of the top: a tenth of it, but within 1 mm of the rims the side walls are nearer
  // than the tolerance reaches, and these are 2 % of the dent.
  const auto report = inspected(over_top(0.5, [](double x, double) { return std::abs(x - 50.0) < 5.0 ? -2.0 : 0.0; }),
                                {.tolerance = Tolerance{-1.0, 1.0}});
  EXPECT_NEAR(report.over_area.under_tolerance.value(), 0.1, 0.02);  // one sample spacing at the dent's border
  EXPECT_EQ(report.over_area.over_tolerance.value(), 0.0);
  EXPECT_NEAR(report.over_points.under_tolerance.value(), 0.098, 1e-9);
}

TEST(Inspect, LeavesFarPointsOutOfEveryFigureAndSaysHowMany) {
  PointCloud cloud = over_top(2.0, [](double, double) { return 0.0; });
  cloud.positions.emplace_back(50.0F, 50.0F, 200.0F);
  cloud.normals.emplace_back(Eigen::Vector3f::UnitZ());
  const DeviationReport report = inspected(cloud);
  EXPECT_EQ(report.far_points, 1U);
  EXPECT_EQ(report.over_points.count, cloud.size() - 1);
  EXPECT_NEAR(report.over_points.max, 0.0, 1e-5);
  EXPECT_NEAR(report.deviation_mm.back(), 100.0F, 1e-4F);  // its own figure stays true
}

TEST(Inspect, DoesNotCallASideScannedByPointsThatLookTheOtherWay) {
  PointCloud cloud = over_top(1.0, [](double, double) { return 0.0; });
  for (Eigen::Vector3f& normal : cloud.normals) normal = -normal;
  EXPECT_EQ(inspected(cloud).coverage, 0.0);
}

TEST(Inspect, OfNoPointsSaysThatNothingWasScanned) {
  const DeviationReport report = inspected({}, {.tolerance = Tolerance{-1.0, 1.0}});
  EXPECT_EQ(report.over_points.count, 0U);
  EXPECT_EQ(report.coverage, 0.0);
  EXPECT_EQ(report.verdict.value(), Verdict::not_scanned);
}

TEST(Inspect, OfASinglePlaceSaysThatNothingWasScanned) {
  const auto at = [](const Eigen::Vector3f& place, std::size_t times) {
    PointCloud cloud;
    cloud.positions.assign(times, place);
    return cloud;
  };
  for (const PointCloud& cloud :
       {at({50.0F, 50.0F, 100.1F}, 1), at({50.0F, 50.0F, 100.1F}, 100), at({5e4F, 5e4F, 5e4F}, 100)}) {
    const DeviationReport report = inspected(cloud);
    EXPECT_EQ(report.coverage, 0.0);
    for (const Spot& spot : report.finder->detailed_at(cube().dense_samples, Context(2))) EXPECT_EQ(spot.points, 0U);
  }
}

TEST(Inspect, OfPointsThatAreThereTwiceSaysTheSame) {
  const PointCloud once = over_top(1.0, [](double x, double) { return 0.01 * x; });
  PointCloud twice = once;
  twice.positions.insert(twice.positions.end(), once.positions.begin(), once.positions.end());
  twice.normals.insert(twice.normals.end(), once.normals.begin(), once.normals.end());
  const DeviationReport single = inspected(once), doubled = inspected(twice);
  EXPECT_EQ(doubled.spacing_mm, single.spacing_mm);
  EXPECT_NEAR(doubled.coverage, single.coverage, 0.01);  // the eight nearest are four places
  EXPECT_NEAR(doubled.over_area.mean, single.over_area.mean, 1e-3);
}

TEST(Inspect, HasNoVerdictWithoutATolerance) {
  EXPECT_FALSE(inspected(over_top(5.0, [](double, double) { return 0.0; })).verdict.has_value());
}

TEST(Inspect, GivesTheSameBitsForAnyNumberOfThreads) {
  Random random(1, "test", 0);
  const PointCloud cloud = over_top(0.7, [&](double, double) { return 0.3 * random.normal(); });
  const DeviationReport one = inspected(cloud, {}, 1), three = inspected(cloud, {}, 3);
  EXPECT_EQ(one.deviation_mm, three.deviation_mm);
  EXPECT_EQ(one.over_points.rms, three.over_points.rms);
  EXPECT_EQ(one.over_area.rms, three.over_area.rms);
  EXPECT_EQ(one.coverage, three.coverage);
}

TEST(Inspect, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  Context context(1);
  context.stop = source.get_token();
  const auto report = inspect(over_top(1.0, [](double, double) { return 0.0; }), cube(), {}, context);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().code, ErrorCode::cancelled);
}

}  // namespace
}  // namespace asbuilt::inspect
