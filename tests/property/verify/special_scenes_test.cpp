// SPDX-License-Identifier: Apache-2.0
// Parts and scans that detection finds hard. What is accepted must be right; how much is found is told, not asserted.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <string>

#include "asbuilt/core/random.h"
#include "asbuilt/detect/detect.h"
#include "asbuilt/simulate/simulate.h"
#include "asbuilt/verify/verify.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

TriangleMesh block(const Eigen::Vector3d& size, const Eigen::Vector3d& where) {
  return simulate::transformed(simulate::box(size), Pose(Eigen::Translation3d(where)));
}

/// Bent sheet metal, 2 mm thick.
TriangleMesh sheet_bracket() {
  return simulate::merged(std::vector<TriangleMesh>{block({200, 100, 2}, {0, 0, 0}), block({2, 100, 60}, {-99, 0, 0}),
                                                    block({60, 2, 30}, {60, 49, 0})});
}

/// 6 mm flat, with low bosses that leave no symmetry.
TriangleMesh flat_cover() {
  return simulate::merged(std::vector<TriangleMesh>{block({200, 120, 6}, {0, 0, 0}), block({40, 20, 16}, {-50, -30, 0}),
                                                    block({30, 30, 12}, {60, 35, 0}),
                                                    block({80, 8, 10}, {20, -40, 0})});
}

simulate::SimulateOptions scenes(std::uint64_t seed) {
  simulate::SimulateOptions options;
  options.scans = 2;
  options.points = 40000;
  options.clutter_objects = 5;
  options.clutter_low = 0.0;
  options.clutter_high = 1.0;
  options.seed = seed;
  return options;
}

/// Largest displacement of a vertex against the true pose, by the motion of the part onto itself that makes it
/// smallest.
double displacement(const Pose& found, const Pose& truth, const TriangleMesh& mesh,
                    const std::vector<Eigen::Matrix3d>& symmetries) {
  double least = std::numeric_limits<double>::infinity();
  const Eigen::Vector3d centre = bounding_box(mesh).center();
  for (const Eigen::Matrix3d& rotation : symmetries) {
    const Pose onto_itself = Eigen::Translation3d(centre) * Pose(rotation) * Eigen::Translation3d(-centre);
    const Pose true_from_found = onto_itself * truth * found.inverse();
    double largest = 0.0;
    for (const Eigen::Vector3d& v : mesh.vertices) largest = std::max(largest, (true_from_found * v - v).norm());
    least = std::min(least, largest);
  }
  return least;
}

/// Judges scans of a part; `change` may alter what was measured. Accepted poses must be right.
template <class Change>
void expect_nothing_wrong(const TriangleMesh& mesh, const simulate::SimulateOptions& options, const Change& change,
                          const std::vector<Eigen::Matrix3d>& symmetries = {Eigen::Matrix3d::Identity()}) {
  const Context context(2);
  const model::PreparedModel model = test::prepared(mesh);
  const auto book = detect::build_codebook(model, {}, context).value();
  const auto simulated = simulate::simulate(mesh, options, context).value();
  int right = 0;
  for (const simulate::SimulatedScan& one : simulated.scans) {
    const PointCloud cloud{change(one), {}};
    const auto scan = scan::prepare_scan(cloud, std::nullopt, {}, {}, context);
    ASSERT_TRUE(scan.has_value()) << scan.error().message;
    const auto hypotheses = detect::find_hypotheses(*scan, *book, {}, context).value();
    const Detection detection = verify(*scan, model, hypotheses, {}, context).value();
    if (detection.status != Status::accepted) continue;
    const double error = displacement(detection.best.model_from_scan, *one.model_from_scan, mesh, symmetries);
    EXPECT_LT(error, 0.02 * model.diameter)
        << "seed " << options.seed << ", " << one.name << ", " << options.sensor << ": " << detection.explanation;
    ++right;
  }
  testing::Test::RecordProperty("accepted_seed_" + std::to_string(options.seed), right);
}

std::vector<Eigen::Vector3f> unchanged(const simulate::SimulatedScan& scan) { return scan.points_in_scan; }

TEST(SpecialScenes, OfThinSheetMetalAreNeverMistaken) {
  for (const std::uint64_t seed : {21U, 22U}) expect_nothing_wrong(sheet_bracket(), scenes(seed), unchanged);
}

TEST(SpecialScenes, OfAFlatCoverAreNeverMistaken) {
  for (const std::uint64_t seed : {23U, 24U}) expect_nothing_wrong(flat_cover(), scenes(seed), unchanged);
}

TEST(SpecialScenes, OfAPlainPlateAreNeverMistakenButForItsHalfTurns) {
  std::vector<Eigen::Matrix3d> half_turns{Eigen::Matrix3d::Identity()};
  for (int axis = 0; axis < 3; ++axis) {
    half_turns.push_back(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::Unit(axis)).toRotationMatrix());
  }
  for (const std::uint64_t seed : {25U, 26U}) {
    expect_nothing_wrong(simulate::box({200, 140, 2}), scenes(seed), unchanged, half_turns);
  }
}

TEST(SpecialScenes, OfASmallPartInALargeHallAreNeverMistaken) {
  simulate::SimulateOptions options = scenes(27);
  options.sensor = "laser-scanner";
  options.points = 80000;
  options.clutter_objects = 12;
  expect_nothing_wrong(test::casing(), options, unchanged);
}

TEST(SpecialScenes, WithNoiseOfAHundredthOfTheDiameterAreNeverMistaken) {
  for (const std::uint64_t seed : {28U, 29U}) {
    simulate::SimulateOptions options = scenes(seed);
    options.noise_ratio = 0.01;
    expect_nothing_wrong(test::casing(), options, unchanged);
  }
}

// A close-up: only what lies around one point of the part, about a third of what is seen of it and a tenth of all.
TEST(SpecialScenes, ThatShowATenthOfThePartAreNeverMistaken) {
  for (const std::uint64_t seed : {30U, 31U, 32U}) {
    Random random(seed, "close-up", 0);
    expect_nothing_wrong(test::casing(), scenes(seed), [&](const simulate::SimulatedScan& scan) {
      std::vector<Eigen::Vector3f> part;
      for (std::size_t i = 0; i < scan.labels.size(); ++i) {
        if (scan.labels[i] == simulate::Label::kPart) part.push_back(scan.points_in_scan[i]);
      }
      const Eigen::Vector3f aim = part[random.below(part.size())];
      std::vector<float> distances;
      for (const Eigen::Vector3f& point : part) distances.push_back((point - aim).norm());
      std::ranges::sort(distances);
      const float radius = distances[distances.size() / 3];
      std::vector<Eigen::Vector3f> close;
      for (const Eigen::Vector3f& point : scan.points_in_scan) {
        if ((point - aim).norm() <= radius) close.push_back(point);
      }
      return close;
    });
  }
}

}  // namespace
}  // namespace asbuilt::verify
