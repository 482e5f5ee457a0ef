// SPDX-License-Identifier: Apache-2.0
// Is the part found in simulated scans, and nothing else taken for it?
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "asbuilt/detect/detect.h"
#include "asbuilt/simulate/simulate.h"
#include "asbuilt/verify/verdict.h"
#include "asbuilt/verify/verify.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

struct Sought {
  Context context{2};
  model::PreparedModel model = test::prepared(test::casing());
  std::shared_ptr<const detect::Codebook> book = detect::build_codebook(model, {}, context).value();

  [[nodiscard]] Detection found_in(const scan::Scan& scan, const Context& on) const {
    return verify(scan, model, detect::find_hypotheses(scan, *book, {}, on).value(), {}, on).value();
  }
  [[nodiscard]] double error(const Detection& detection, const Pose& truth) const {
    return displacement_mm(detection.best.model_from_scan, truth, model) / model.diameter;
  }
};

const Sought& sought() {
  static const Sought the_sought;
  return the_sought;
}

simulate::SimulateOptions small_scenes() {
  simulate::SimulateOptions options;
  options.scans = 2;
  options.points = 25000;
  options.clutter_objects = 4;
  options.clutter_low = 0.0;
  options.clutter_high = 1.0;
  options.hidden_high = 0.15;
  options.seed = 3;
  return options;
}

std::vector<simulate::SimulatedScan> scans_of(const simulate::SimulateOptions& options) {
  return simulate::simulate(test::casing(), options, sought().context).value().scans;
}

scan::Scan prepared(const simulate::SimulatedScan& simulated, const scan::ViewpointRequest& request = {}) {
  return scan::prepare_scan({simulated.points_in_scan, {}}, std::nullopt, request, {}, sought().context).value();
}

TEST(SimulatedScenes, ShowThePartInItsPlace) {
  for (const auto& simulated : scans_of(small_scenes())) {
    const Detection detection = sought().found_in(prepared(simulated), sought().context);
    EXPECT_EQ(detection.status, Status::accepted) << simulated.name << ": " << detection.explanation;
    EXPECT_LT(sought().error(detection, *simulated.model_from_scan), 0.02) << simulated.name;
  }
}

TEST(SimulatedScenes, ShowThePartWithoutViewpointAndNormals) {
  for (const auto& simulated : scans_of(small_scenes())) {
    const scan::Scan scan = prepared(simulated, {false, {}});
    ASSERT_FALSE(scan.normals_oriented);
    const Detection detection = sought().found_in(scan, sought().context);
    EXPECT_EQ(detection.status, Status::accepted) << simulated.name << ": " << detection.explanation;
    EXPECT_LT(sought().error(detection, *simulated.model_from_scan), 0.02) << simulated.name;
  }
}

TEST(SimulatedScenes, WithoutThePartAreRejectedWithoutViewpointToo) {
  simulate::SimulateOptions options = small_scenes();
  options.absent_share = 1.0;
  options.decoys = 1;
  for (const auto& simulated : scans_of(options)) {
    const Detection detection = sought().found_in(prepared(simulated, {false, {}}), sought().context);
    EXPECT_EQ(detection.status, Status::rejected) << simulated.name << ": " << detection.explanation;
  }
}

TEST(SimulatedScenes, WithoutThePartAreRejected) {
  simulate::SimulateOptions options = small_scenes();
  options.absent_share = 1.0;
  for (const auto& simulated : scans_of(options)) {
    const Detection detection = sought().found_in(prepared(simulated), sought().context);
    EXPECT_EQ(detection.status, Status::rejected) << simulated.name << ": " << detection.explanation;
    EXPECT_TRUE(detection.segment.empty());
  }
}

TEST(SimulatedScenes, WithASmallerCopyInItsPlaceAreRejected) {
  simulate::SimulateOptions options = small_scenes();
  options.absent_share = 1.0;
  options.decoys = 1;
  options.decoy_scale = 0.78;
  for (const auto& simulated : scans_of(options)) {
    const Detection detection = sought().found_in(prepared(simulated), sought().context);
    EXPECT_EQ(detection.status, Status::rejected) << simulated.name << ": " << detection.explanation;
  }
}

TEST(SimulatedScenes, WithTwoPartsAreAmbiguous) {
  const double d = sought().model.diameter;
  const Pose left = test::pose_at({-0.55 * d, 0, 3.0 * d}),
             right = test::pose_at({0.55 * d, 0, 3.0 * d}, {1.0, 2.0, 0.3});
  const scan::Scan scan = test::seen(
      {simulate::transformed(test::casing(), left), simulate::transformed(test::casing(), right)}, 0.4, 0.004);
  const Detection detection = sought().found_in(scan, sought().context);
  EXPECT_EQ(detection.status, Status::ambiguous) << detection.explanation;
  EXPECT_EQ(detection.reason, Reason::second_instance);
  EXPECT_LT(std::min(sought().error(detection, left.inverse()), sought().error(detection, right.inverse())), 0.02);
}

TEST(SimulatedScenes, AreJudgedAlikeByAnyNumberOfThreads) {
  simulate::SimulateOptions options = small_scenes();
  options.scans = 1;
  const scan::Scan scan = prepared(scans_of(options).front());
  const Detection expected = sought().found_in(scan, Context(1));
  for (const int threads : {2, 3}) {
    const Detection detection = sought().found_in(scan, Context(threads));
    EXPECT_EQ(detection.best.model_from_scan.matrix(), expected.best.model_from_scan.matrix());
    EXPECT_EQ(detection.best.support, expected.best.support);
    EXPECT_EQ(detection.segment, expected.segment);
    EXPECT_EQ(detection.margin_points, expected.margin_points);
    EXPECT_EQ(detection.explanation, expected.explanation);
  }
}

// What departs from the CAD is what the user is looking for; what stands beside the part is not the part.
TEST(Segmentation, KeepsBossesAndDentsAndLeavesClutter) {
  simulate::SimulateOptions options = small_scenes();
  options.as_built.dents = 6;
  options.as_built.bosses = 6;
  options.as_built.bump_height_ratio = 0.03;
  for (const auto& simulated : scans_of(options)) {
    const scan::Scan scan = prepared(simulated);
    const Detection detection = sought().found_in(scan, sought().context);
    ASSERT_NE(detection.status, Status::rejected) << simulated.name << ": " << detection.explanation;
    std::vector<std::uint8_t> kept(scan.cloud.size(), 0);
    for (const std::uint32_t i : detection.segment) kept[i] = 1;
    double of_part = 0, part_kept = 0, bumps = 0, bumps_kept = 0, others_kept = 0;
    for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
      const std::uint8_t label = simulated.labels[scan.source_index[i]];
      if (label != simulate::Label::kPart) {
        others_kept += label != simulate::Label::kFlying && kept[i] != 0 ? 1 : 0;
        continue;
      }
      ++of_part, part_kept += kept[i];
      const Eigen::Vector3d point = *simulated.model_from_scan * scan.cloud.positions[i].cast<double>();
      const auto nearest = sought().model.surface->nearest(point, sought().model.diameter);
      if (std::abs(nearest.signed_distance) < 0.008 * sought().model.diameter) continue;
      ++bumps, bumps_kept += kept[i];
    }
    const double segment = static_cast<double>(detection.segment.size());
    EXPECT_GT(part_kept / of_part, 0.97) << simulated.name;
    EXPECT_LT(others_kept / segment, 0.01) << simulated.name;
    ASSERT_GT(bumps, 20) << simulated.name << " shows no bump";
    EXPECT_GT(bumps_kept / bumps, 0.9) << simulated.name;
  }
}

}  // namespace
}  // namespace asbuilt::verify
