// SPDX-License-Identifier: Apache-2.0
// Spots, regions, alignment and check points on a cube whose sides were measured.
#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "asbuilt/core/random.h"
#include "asbuilt/inspect/deviation.h"
#include "unit/model/shapes.h"

namespace asbuilt::inspect {
namespace {

constexpr double kPartEdge = 100.0;

const model::PreparedModel& cubic_part() {
  static const model::PreparedModel model =
      model::prepare(test::joined(test::box({0, 0, 0}, {kPartEdge, kPartEdge, kPartEdge})), {}, Context(2)).value();
  return model;
}

/// A grid of points on one side, `height(u, v)` outside of it.
template <class Height>
void add_side(PointCloud& cloud, int axis, bool high, double step, const Height& height) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  for (double a = 0.5 * step; a < kPartEdge; a += step) {
    for (double b = 0.5 * step; b < kPartEdge; b += step) {
      Eigen::Vector3d p;
      p[axis] = high ? kPartEdge + height(a, b) : -height(a, b);
      p[u] = a;
      p[v] = b;
      cloud.positions.push_back(p.cast<float>());
      cloud.normals.push_back((high ? 1.0F : -1.0F) * Eigen::Vector3f::Unit(axis));
    }
  }
}

PointCloud all_sides(double step, double sigma = 0.0) {
  PointCloud cloud;
  Random random(7, "sides", 0);
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      add_side(cloud, axis, high, step, [&](double, double) { return sigma * random.normal(); });
    }
  }
  return cloud;
}

/// (1 - r^2/R^2)^2 deep about the middle of a side.
double dent(double a, double b, double depth, double radius) {
  const double share = (std::pow(a - 50.0, 2) + std::pow(b - 50.0, 2)) / (radius * radius);
  return share < 1.0 ? -depth * std::pow(1.0 - share, 2) : 0.0;
}

TEST(Spots, StateTheErrorThatTheyHave) {
  const double sigma = 0.2;
  const DeviationReport report = inspect(all_sides(1.0, sigma), cubic_part(), {}, Context(2)).value();
  EXPECT_NEAR(report.noise_sigma_mm, sigma, 0.1 * sigma);
  double squares = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < report.spots.size(); ++i) {
    const Eigen::Vector3d p = cubic_part().dense_samples.positions[i].cast<double>();
    int far_from_edges = 0;  // there the nearest surface is another side's, and noise is folded
    for (int axis = 0; axis < 3; ++axis) far_from_edges += p[axis] > 4.0 && p[axis] < kPartEdge - 4.0 ? 1 : 0;
    if (!report.spots[i].is_scanned() || far_from_edges < 2) continue;
    const double pull = static_cast<double>(report.spots[i].deviation_mm / report.spots[i].standard_error_mm);
    squares += pull * pull;
    ++count;
  }
  // True deviations are zero: the pulls scatter by one, to a tenth with a thousand spots that overlap.
  ASSERT_GT(count, 1000U);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 1.0, 0.1);
  // Of normal errors 0.27 % exceed three sigma.
  EXPECT_LT(report.significant_share, 0.03);
  EXPECT_GT(report.coverage, 0.99);  // along edges noise takes some points to the other side
}

TEST(Spots, OfAMergedCloudKnowThatItsPointsShareTheirNoise) {
  // Each point is the mean of the nine measurements within a step of it, as merging makes them: they scatter by a third
  // of the noise, but the mean over a neighbourhood is no better known than before.
  const double sigma = 0.2, step = 0.3;
  constexpr std::size_t kRows = 340;
  Random random(11, "merged", 0);
  std::vector<double> raw(kRows * kRows);
  for (double& value : raw) value = sigma * random.normal();
  PointCloud cloud;
  add_side(cloud, 2, true, step, [&](double a, double b) {
    const auto row = static_cast<std::size_t>(a / step), column = static_cast<std::size_t>(b / step);
    double sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) sum += raw[(row + i) * kRows + column + j];
    }
    return sum / 9.0;
  });
  const DeviationReport report = inspect(cloud, cubic_part(), {}, Context(2)).value();
  EXPECT_LT(report.noise_sigma_mm, 0.4 * sigma);
  double squares = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < report.spots.size(); ++i) {
    const Eigen::Vector3d p = cubic_part().dense_samples.positions[i].cast<double>();
    if (!report.spots[i].is_scanned() || std::max(std::abs(p.x() - 50.0), std::abs(p.y() - 50.0)) > 45.0) continue;
    const double pull = static_cast<double>(report.spots[i].deviation_mm / report.spots[i].standard_error_mm);
    squares += pull * pull;
    ++count;
  }
  // Without it the pulls scatter by some three. The quadrants by which the sharing is told are small beside the
  // neighbourhoods that share, so that some of it is missed.
  ASSERT_GT(count, 200U);
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 1.15, 0.3);
}

TEST(Spots, TakeInHowWellAScanIsPlaced) {
  PointCloud cloud;
  add_side(cloud, 2, true, 1.0, [](double, double) { return 0.0; });
  const std::vector<std::uint16_t> scan(cloud.size(), 4);
  ScanPose pose{4, Matrix6d::Zero()};
  pose.covariance(5, 5) = 0.25;  // of the shift along z, mm^2
  const std::vector<ScanPose> poses{pose};
  Measurement measurement{cloud, scan};
  measurement.poses = poses;
  const DeviationReport report = inspect(measurement, cubic_part(), {}, Context(1)).value();
  for (const Spot& spot : report.spots) {
    if (!spot.is_scanned()) continue;
    EXPECT_EQ(spot.scan, 4);
    EXPECT_EQ(spot.scans, 1);
  }
  const auto middle = std::ranges::find_if(report.spots, &Spot::is_scanned);
  ASSERT_NE(middle, report.spots.end());
  EXPECT_NEAR(middle->standard_error_mm, 0.5, 0.01);
}

TEST(Spots, DoNotReachBeyondHalfASpacingOfARimNorOverAHole) {
  PointCloud cloud;
  add_side(cloud, 2, true, 1.0, [](double, double) { return 0.0; });
  const auto keep = [&](auto&& inside) {
    PointCloud kept;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (!inside(cloud.positions[i].cast<double>())) continue;
      kept.positions.push_back(cloud.positions[i]);
      kept.normals.push_back(cloud.normals[i]);
    }
    return inspect(kept, cubic_part(), {}, Context(1)).value().coverage;
  };
  // Of the whole side as it is found: where samples of its own rim belong is another matter.
  const double side = keep([](const Eigen::Vector3d&) { return true; });
  EXPECT_NEAR(side, 1.0 / 6.0, 0.005);
  // Half of the side up to x = 50, and all of it but a disc of radius 12. Half a spacing more along the rim of the half
  // would be 1 % of it, a whole sample spacing 3 %.
  EXPECT_NEAR(keep([](const Eigen::Vector3d& p) { return p.x() < 50.0; }) / side, 0.5, 0.006);
  const double disc = std::numbers::pi * 144.0 / 1e4;
  EXPECT_NEAR(keep([](const Eigen::Vector3d& p) { return std::hypot(p.x() - 50.0, p.y() - 50.0) > 12.0; }) / side,
              1.0 - disc, 0.006);
}

TEST(Regions, MeasureADentWithoutLevellingIt) {
  const double depth = 2.0, radius = 12.0, sigma = 0.1;
  Random random(3, "dent", 0);
  PointCloud cloud;
  add_side(cloud, 2, true, 0.8,
           [&](double a, double b) { return dent(a, b, depth, radius) + sigma * random.normal(); });
  const DeviationReport report = inspect(cloud, cubic_part(), {.tolerance = Tolerance{-0.5, 0.5}}, Context(2)).value();
  ASSERT_EQ(report.regions.size(), 1U);
  const Region& region = report.regions.front();
  EXPECT_NEAR(region.peak.deviation_mm, -depth, std::max(0.3 * sigma, 3.0 * region.peak.standard_error_mm));
  EXPECT_LT(region.peak.standard_error_mm, 0.5 * sigma);
  EXPECT_NEAR((region.peak.point - Eigen::Vector3d(50, 50, kPartEdge)).norm(), 0.0, 1.5);
  // Deeper than 0.5 of 2.0 within r = R sqrt(1 - sqrt(0.25)).
  const double true_radius = radius * std::sqrt(0.5);
  EXPECT_NEAR(region.area_mm2, std::numbers::pi * true_radius * true_radius, 0.12 * region.area_mm2);
  EXPECT_EQ(report.faces[region.face].verdict, Verdict::fail);
  EXPECT_TRUE(region.significant);
  EXPECT_EQ(report.verdict, Verdict::fail);
}

TEST(Regions, AreCountedWhereNotAllAreGiven) {
  PointCloud cloud;
  const auto in_pad = [](double x) { return std::fmod(x, 12.5) > 3.0 && std::fmod(x, 12.5) < 9.5; };
  add_side(cloud, 2, true, 0.5, [&](double a, double b) { return in_pad(a) && in_pad(b) ? 1.0 : 0.0; });
  const DeviationReport report = inspect(cloud, cubic_part(), {.tolerance = Tolerance{-0.5, 0.5}}, Context(2)).value();
  EXPECT_EQ(report.regions_found, 64U);  // eight rows of eight pads
  EXPECT_EQ(report.regions.size(), RegionOptions{}.most);
}

TEST(Regions, AreNotInventedInNoise) {
  const DeviationReport report =
      inspect(all_sides(1.0, 0.2), cubic_part(), {.tolerance = Tolerance{-0.4, 0.4}}, Context(2)).value();
  EXPECT_TRUE(report.regions.empty());
  EXPECT_EQ(report.verdict, Verdict::pass);
}

TEST(Tolerances, HoldPerBoxAndLeaveTheRestAlone) {
  PointCloud cloud;
  add_side(cloud, 2, true, 1.0, [](double a, double) { return a < 20.0 ? 0.3 : 0.0; });
  InspectOptions options;
  ToleranceRow row{"strip",
                   std::nullopt,
                   Eigen::AlignedBox3d(Eigen::Vector3d(2, 2, 99), Eigen::Vector3d(18, 98, 101)),
                   {-0.1, 0.1},
                   1};
  options.tolerances.rows.push_back(row);
  const DeviationReport report = inspect(cloud, cubic_part(), options, Context(1)).value();
  ASSERT_EQ(report.boxes.size(), 1U);
  EXPECT_EQ(report.boxes[0].verdict, Verdict::fail);
  EXPECT_NEAR(report.boxes[0].statistics.mean, 0.3, 1e-3);
  for (const SurfacePart& face : report.faces) EXPECT_FALSE(face.verdict.has_value());
  EXPECT_EQ(report.verdict, Verdict::fail);
}

TEST(Tolerances, RefuseAFaceThatIsNotThere) {
  InspectOptions options;
  options.tolerances.rows.push_back({"face 3", 3, std::nullopt, {-1, 1}, 12});
  const auto report = inspect(all_sides(5.0), cubic_part(), options, Context(1));
  ASSERT_FALSE(report.has_value());
  EXPECT_THAT(report.error().message, ::testing::HasSubstr("line 12"));
}

/// The cube with two triangles a CAD face, all but the last called by a name; two share one.
const model::PreparedModel& named_cube() {
  static const model::PreparedModel model = [] {
    TriangleMesh mesh = test::joined(test::box({0, 0, 0}, {kPartEdge, kPartEdge, kPartEdge}));
    for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) mesh.cad_faces.push_back(t / 2);
    model::PreparedModel prepared = model::prepare(mesh, {}, Context(2)).value();
    prepared.face_names = {{"bore A", ""}, {"rim", ""}, {"rim", ""}, {"<script>", ""}, {"foot", ""}};
    return prepared;
  }();
  return model;
}

Result<DeviationReport> with_tolerances(std::string_view rows, const model::PreparedModel& model) {
  InspectOptions options;
  options.tolerances = tolerances_in(rows, "drawing.csv").value();
  return inspect(all_sides(4.0), model, options, Context(1));
}

std::string refusal_of(std::string_view rows, const model::PreparedModel& model) {
  const auto report = with_tolerances(rows, model);
  return report ? "no error" : report.error().message;
}

TEST(Tolerances, HoldForTheFaceThatBearsTheName) {
  const DeviationReport report = with_tolerances("bore A,-0.1,0.2\nface 4,-1,1\n", named_cube()).value();
  ASSERT_EQ(report.faces.size(), 6U);
  EXPECT_EQ(report.faces[0].name, "face 0 \"bore A\"");
  EXPECT_EQ(report.faces[0].tolerance->high_mm, 0.2);
  EXPECT_EQ(report.faces[4].name, "face 4 \"foot\"");
  EXPECT_EQ(report.faces[4].tolerance->high_mm, 1.0);
  EXPECT_FALSE(report.faces[3].tolerance.has_value());
  EXPECT_EQ(report.faces[5].name, "face 5");
  EXPECT_EQ(report.verdict, Verdict::pass);
}

TEST(Tolerances, OfANameThatNoFaceOrMoreThanOneBearsAreRefused) {
  using ::testing::AllOf;
  using ::testing::HasSubstr;
  EXPECT_THAT(refusal_of("*,-1,1\nbore B,-1,1\n", named_cube()),
              AllOf(HasSubstr("drawing.csv, line 2"), HasSubstr("'bore B'"), HasSubstr("face 0 \"bore A\""),
                    HasSubstr("number")));
  EXPECT_THAT(refusal_of("rim,-1,1\n", named_cube()),
              AllOf(HasSubstr("drawing.csv, line 1"), HasSubstr("2 CAD faces are called 'rim'"),
                    HasSubstr("face 1 \"rim\", face 2 \"rim\"")));
  EXPECT_THAT(refusal_of("bore A,-1,1\n0,-2,2\n", named_cube()),
              AllOf(HasSubstr("line 2"), HasSubstr("second tolerance")));
  EXPECT_THAT(refusal_of("rim,-1,1\n", cubic_part()), AllOf(HasSubstr("line 1"), HasSubstr("mesh"), HasSubstr("box")));
}

TEST(BestFit, TakesARigidMotionBackAndNeverAScale) {
  PointCloud cloud = all_sides(2.0);
  Vector6d twist;
  twist << 0.004, -0.006, 0.003, 0.4, -0.3, 0.6;
  const Pose moved = pose_from_twist(twist);
  for (auto& p : cloud.positions) p = (moved * p.cast<double>()).cast<float>();
  for (auto& n : cloud.normals) n = (moved.linear() * n.cast<double>()).cast<float>();
  InspectOptions options;
  options.alignment.method = AlignmentMethod::best_fit;
  const DeviationReport report = inspect(cloud, cubic_part(), options, Context(2)).value();
  EXPECT_TRUE((report.alignment.model_from_given * moved).isApprox(Pose::Identity(), 1e-4));
  EXPECT_NEAR(report.over_points.rms, 0.0, 2e-3);
  EXPECT_LT(report.alignment.rms_after_mm, 0.05 * report.alignment.rms_before_mm);

  // A part that is 1 % too large stays too large: each side by half a millimetre.
  PointCloud large = all_sides(2.0);
  for (auto& p : large.positions) p = ((p.array() - 50.0F) * 1.01F + 50.0F).matrix();
  const DeviationReport grown = inspect(large, cubic_part(), options, Context(2)).value();
  EXPECT_NEAR(grown.over_points.mean, 0.5, 0.01);
}

TEST(BestFit, OnSomePlacesLeavesTheRestToDeviate) {
  // One side is 0.8 mm too high; the fit is made on the five others.
  PointCloud cloud;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool high : {false, true}) {
      add_side(cloud, axis, high, 2.0, [&](double, double) { return axis == 2 && high ? 0.8 : 0.0; });
    }
  }
  InspectOptions options;
  options.alignment.method = AlignmentMethod::best_fit;
  options.alignment.place_radius_ratio = 0.2;
  options.alignment.places = {{50, 50, 0}, {0, 50, 40}, {100, 50, 40}, {50, 0, 40}, {50, 100, 40}};
  const DeviationReport report = inspect(cloud, cubic_part(), options, Context(2)).value();
  EXPECT_EQ(report.alignment.on, "5 places");
  EXPECT_NEAR(report.over_points.max, 0.8, 0.01);
  EXPECT_NEAR(report.over_points.median, 0.0, 0.01);
}

TEST(BestFit, RefusesFacesOfAMesh) {
  InspectOptions options;
  options.alignment.method = AlignmentMethod::best_fit;
  options.alignment.faces = {2};
  EXPECT_FALSE(inspect(all_sides(5.0), cubic_part(), options, Context(1)).has_value());
}

TEST(ReferencePoints, AreReadWithAndWithoutNameAndSigma) {
  const auto points = reference_points_in("x,y,z\n1,2,3\nP7,4,5,6,0.02\n7;8,5;9\n", "p").value();
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[0].name, "1");
  EXPECT_FALSE(points[0].sigma_mm.has_value());
  EXPECT_EQ(points[1].name, "P7");
  EXPECT_EQ(points[1].sigma_mm, 0.02);
  EXPECT_EQ(points[2].position, Eigen::Vector3d(7, 8.5, 9));
  EXPECT_THAT(reference_points_in("1,2,3\n1,2\n", "p").error().message, ::testing::HasSubstr("line 2"));
  EXPECT_THAT(reference_points_in("1,2,3,-1\n", "p").error().message, ::testing::HasSubstr("negative"));
  EXPECT_FALSE(reference_points_in("# none\n", "p").has_value());
}

TEST(ReferencePoints, GetTheHeightOfTheReconstructionOverThem) {
  PointCloud cloud;
  add_side(cloud, 2, true, 1.0, [](double, double) { return 0.25; });
  InspectOptions options;
  options.reference = {
      {"top", {30, 40, kPartEdge}, 0.05}, {"below", {60, 40, kPartEdge + 0.4}, {}}, {"side", {0, 50, 50}, {}}};
  for (const bool with_normals : {true, false}) {
    if (!with_normals) cloud.normals.clear();
    const DeviationReport report = inspect(cloud, cubic_part(), options, Context(1)).value();
    const auto& deviations = report.reference->deviations;
    EXPECT_NEAR(deviations[0].deviation_mm, 0.25, 1e-4);
    EXPECT_TRUE(deviations[0].significant.value());
    EXPECT_NEAR(deviations[0].standard_error_mm, 0.05, 1e-3);
    EXPECT_NEAR(deviations[1].deviation_mm, -0.15, 1e-4);
    EXPECT_FALSE(deviations[2].measured);
    EXPECT_EQ(report.reference->statistics.count, 2U);
  }
}

TEST(StatisticsOfMany, AreThoseOfTheOthers) {
  Random random(5, "many", 0);
  std::vector<float> floats{0.0F, -0.0F};
  std::vector<double> doubles{0.0, 0.0};
  for (int i = 0; i < 5000; ++i) {
    floats.push_back(static_cast<float>(random.normal()));
    doubles.push_back(static_cast<double>(floats.back()));
  }
  const DeviationStatistics a = statistics_of_many(floats, Tolerance{-1, 1}), b = statistics(doubles, Tolerance{-1, 1});
  EXPECT_EQ(a.mean, b.mean);
  EXPECT_EQ(a.rms, b.rms);
  EXPECT_EQ(a.median, b.median);
  EXPECT_EQ(a.p99, b.p99);
  EXPECT_EQ(a.in_tolerance, b.in_tolerance);
}

}  // namespace
}  // namespace asbuilt::inspect
