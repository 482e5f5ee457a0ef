// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/near_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "asbuilt/verify/verdict.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

constexpr double kPi = std::numbers::pi;

Pose turn_about_z(double angle) {
  return model::rotation_about(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::Zero(), angle);
}

bool has_pose(const std::vector<Pose>& poses, const Pose& wanted, const model::PreparedModel& model) {
  return std::ranges::any_of(
      poses, [&](const Pose& pose) { return displacement_modulo_mm(pose, wanted, model) < 0.02 * model.diameter; });
}

TEST(NearPoses, OfANotchedPlateAreItsOtherQuarterTurns) {
  const model::PreparedModel model = test::prepared(test::notched_plate(20.0), 0.04);
  const Pose scan_from_model = test::pose_at({0, 0, 600}), pose = scan_from_model.inverse();
  const scan::Scan scan = test::seen({simulate::transformed(test::notched_plate(20.0), scan_from_model)});
  const std::vector<Pose> near = near_poses(pose, scan.cloud.positions, model, 0.7);
  for (const double angle : {kPi / 2, kPi, -kPi / 2})
    EXPECT_TRUE(has_pose(near, turn_about_z(angle) * pose, model)) << angle;
  EXPECT_FALSE(has_pose(near, pose, model));
}

TEST(NearPoses, OfAPartWithoutNearSymmetryAreNone) {
  const model::PreparedModel model = test::prepared(test::stepped_block(), 0.05);
  const scan::Scan scan = test::seen({simulate::transformed(test::stepped_block(), test::pose_at({0, 0, 600}))});
  EXPECT_TRUE(near_poses(test::pose_at({0, 0, 600}).inverse(), scan.cloud.positions, model, 0.7).empty());
}

PoseEvidence evidence_of(const scan::Scan& scan, const Pose& pose, const model::PreparedModel& model) {
  const ScanEvidence asked(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  return evidence_for(pose, model.dense_samples, model, asked, {0.7, std::max(0.7, 2.5 * scan.spacing_mm)});
}

TEST(WeakestDirection, OfACylinderDoesNotCountItsTurn) {
  const TriangleMesh mesh = simulate::cylinder(40, 90, 96);
  const model::PreparedModel model = test::prepared(mesh, 0.04);
  const Pose slanted = test::pose_at({0, 0, 600}, {0.8, 0.3, 0.2});  // shows its side and one end
  const PoseEvidence evidence =
      evidence_of(test::seen({simulate::transformed(mesh, slanted)}), slanted.inverse(), model);
  EXPECT_LT(evidence.weakest_direction(), 0.001);
  EXPECT_GT(weakest_direction(evidence, model, false), 0.0035);
  // From the side alone it could slide along its axis.
  const Pose upright = test::pose_at({0, 0, 600}, {kPi / 2, 0, 0});
  PoseEvidence side = evidence_of(test::seen({simulate::transformed(mesh, upright)}), upright.inverse(), model);
  EXPECT_LT(weakest_direction(side, model, false), 0.001);
}

TEST(WeakestDirection, OfAPartWithoutSymmetryIsThatOfTheEvidence) {
  const model::PreparedModel model = test::prepared(test::stepped_block(), 0.05);
  const Pose pose = test::pose_at({0, 0, 600});
  const PoseEvidence evidence =
      evidence_of(test::seen({simulate::transformed(test::stepped_block(), pose)}), pose.inverse(), model);
  EXPECT_EQ(weakest_direction(evidence, model, true), evidence.weakest_direction());
}

}  // namespace
}  // namespace asbuilt::verify
