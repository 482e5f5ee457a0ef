// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/near_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <tuple>

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

// The outer 80 mm of an angle's wide leg, and one end, in the scan frame.
std::vector<Eigen::Vector3f> outside_of_wide_leg(const model::PreparedModel& model, const Pose& scan_from_model) {
  const Eigen::Vector3d low = model.box.min(), high = model.box.max();
  std::vector<Eigen::Vector3f> seen;
  for (double x = high.x() - 80.0; x <= high.x(); x += 4.0) {
    for (double z = low.z(); z <= 0.0; z += 4.0) {
      seen.push_back((scan_from_model * Eigen::Vector3d(x, low.y(), z)).cast<float>());
    }
  }
  return seen;
}

// Of an angle of 120 x 80 mm, the outer 80 mm of the wide leg and one end are in sight: they fit the narrow leg as
// well.
TEST(TurnedInBox, OfAnAngleHalfSeenIsTheOtherLeg) {
  const TriangleMesh mesh = simulate::l_profile(120.0, 80.0, 12.0, 300.0);
  const model::PreparedModel model = test::prepared(mesh, 0.04);
  const Eigen::Vector3d low = model.box.min(), high = model.box.max();
  ASSERT_NEAR(high.x() - low.x(), 120.0, 0.1);
  ASSERT_NEAR(high.y() - low.y(), 80.0, 0.1);
  const Pose scan_from_model = test::pose_at({0, 0, 600}), pose = scan_from_model.inverse();
  const std::vector<Eigen::Vector3f> seen = outside_of_wide_leg(model, scan_from_model);
  // The mirror image in the legs' bisector, turned end for end: (x, y, z) goes to (y, x - 40, -z), from the corner.
  Pose swapped = Pose::Identity();
  swapped.linear() << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  swapped.translation() << low.x() - low.y(), low.y() - low.x() - 40.0, low.z() + high.z();
  EXPECT_TRUE(has_pose(turned_in_box(pose, seen, model, 0.7), swapped * pose, model));
  for (const Pose& turned : turned_in_box(pose, seen, model, 0.7)) {
    EXPECT_GT(displacement_modulo_mm(turned, pose, model), 0.05 * model.diameter);
    const auto on_model = std::ranges::count_if(seen, [&](const Eigen::Vector3f& point) {
      return std::abs(model.field->at((turned * point.cast<double>()).cast<float>()).distance) < 2.0F;
    });
    EXPECT_GE(static_cast<double>(on_model), 0.75 * static_cast<double>(seen.size()));
  }
}

// Its wide leg seen from outside may also be the same leg seen from inside: its other face lies amid the part's box.
TEST(TurnedInBox, OfALegSeenFromOutsideIsItsInside) {
  const model::PreparedModel model = test::prepared(simulate::l_profile(120.0, 80.0, 12.0, 300.0), 0.04);
  const Eigen::Vector3d low = model.box.min(), high = model.box.max();
  const Pose scan_from_model = test::pose_at({0, 0, 600}), pose = scan_from_model.inverse();
  const std::vector<Eigen::Vector3f> seen = outside_of_wide_leg(model, scan_from_model);
  // Half a turn about the length, by which (x, y) goes to (-x, -y); the face then lies 12 mm further in.
  Pose from_inside = Pose::Identity();
  from_inside.linear() = Eigen::Vector3d(-1, -1, 1).asDiagonal();
  from_inside.translation() << 2.0 * high.x() - 80.0, 2.0 * low.y() + 12.0, 0.0;
  EXPECT_TRUE(has_pose(turned_in_box(pose, seen, model, 0.7), from_inside * pose, model));
}

// A drum, 80 mm across and 90 mm high, with five ribs 6 mm wide along its side.
TriangleMesh ribbed_drum(double rib_height) {
  constexpr int kSides = 240;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, 90}};
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2.0 * kPi * i / kSides, from_rib = 40.0 * std::remainder(angle, 2.0 * kPi / 5.0);
    const double radius = 40.0 + (std::abs(from_rib) < 3.0 ? rib_height : 0.0);
    for (const double z : {0.0, 90.0})
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
  }
  for (int i = 0; i < kSides; ++i) {
    const int a = 2 + 2 * i, b = 2 + 2 * ((i + 1) % kSides);
    for (const auto& [u, v, w] :
         {std::tuple(a, b, b + 1), std::tuple(a, b + 1, a + 1), std::tuple(0, b, a), std::tuple(1, a + 1, b + 1)}) {
      mesh.triangles.emplace_back(u, v, w);
    }
  }
  return mesh;
}

TEST(TurnsAreNearlyEqual, OfADrumWithLowRibsButNotWithHighOnes) {
  const model::PreparedModel low = test::prepared(ribbed_drum(1.0), 0.04);  // 0.8 % of the diameter
  ASSERT_FALSE(low.symmetry.near_axes.empty()) << low.symmetry.describe();
  EXPECT_TRUE(turns_are_nearly_equal(low, 0.01));
  EXPECT_FALSE(turns_are_nearly_equal(low, 0.004));
  EXPECT_FALSE(turns_are_nearly_equal(test::prepared(ribbed_drum(4.0), 0.04), 0.01));
  EXPECT_FALSE(turns_are_nearly_equal(test::prepared(test::stepped_block(), 0.05), 0.01));  // has no such axis
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
