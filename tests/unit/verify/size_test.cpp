// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/size.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "asbuilt/verify/contrast.h"
#include "asbuilt/verify/verify.h"
#include "unit/verify/asked.h"

namespace asbuilt::verify {
namespace {

// What evidence_for() sums up, of every sample whose normal has a positive product with `side`, or of all.
PoseEvidence all_found(const model::PreparedModel& model, const std::optional<Eigen::Vector3d>& side) {
  PoseEvidence evidence;
  for (std::size_t i = 0; i < model.dense_samples.size(); ++i) {
    const Eigen::Vector3d normal = model.dense_samples.normals[i].cast<double>();
    if (side && normal.dot(*side) < 0.1) continue;
    const Eigen::Vector3d lever =
        (model.dense_samples.positions[i].cast<double>() - model.box.center()) / (0.5 * model.diameter);
    Vector6d row;
    row << lever.cross(normal), normal;
    evidence.information += row * row.transpose();
    evidence.twist_growth += lever.dot(normal) * row;
    evidence.growth += lever.dot(normal) * lever.dot(normal);
    ++evidence.explained_samples;
  }
  return evidence;
}

// A box that grows about its centre by the growth of its half diameter h leaves face i, half of its edge e_i away, by
// e_i / 2 / h; on all six faces no motion makes up for it.
TEST(SizeHold, OfAWholeBoxIsTheMeanSquareOfTheWayOfItsFaces) {
  const model::PreparedModel brick = test::prepared(simulate::box(test::kBrick));
  double areas = 0.0, sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    const double area = test::kBrick.prod() / test::kBrick[i], way = test::kBrick[i] / test::kBrick.norm();
    areas += area;
    sum += area * way * way;
  }
  EXPECT_NEAR(size_hold(all_found(brick, std::nullopt)), sum / areas, 0.02 * sum / areas);
}

TEST(SizeHold, IsNoneOnThreeFacesAtACorner) {
  const model::PreparedModel brick = test::prepared(simulate::box(test::kBrick));
  EXPECT_LT(size_hold(all_found(brick, Eigen::Vector3d(1, 1, 1))), 0.01 * test::kLimits.min_weakest_direction);
}

TEST(SizeHold, OfASphereIsThatOfItsRadiusAsFarAsItIsSeen) {
  const model::PreparedModel ball = test::prepared(simulate::sphere(40.0, 4));
  const PoseEvidence half = all_found(ball, Eigen::Vector3d(0, 0, 1));
  EXPECT_GT(size_hold(half), 2.0 * test::kLimits.min_weakest_direction);
  EXPECT_LT(size_hold(half), size_hold(all_found(ball, std::nullopt)));
}

/// A box in a scan, looked at from its corner, asked as a box of `believed` edges whose corner lies there.
struct Believed : test::Asked {
  Believed(const Eigen::Vector3d& built, const Eigen::Vector3d& believed, const std::vector<TriangleMesh>& others)
      : test::Asked(test::prepared(simulate::box(believed)),
                    (test::corner_ahead(500) * Eigen::Translation3d(0.5 * (built - believed))).inverse(),
                    test::with(others, simulate::box(built), test::corner_ahead(500)), 0.25) {}
  [[nodiscard]] double lead() const { return size_lead(model_from_scan, evidence, model, *seen_by, options); }
};

TEST(SizeLead, TellsABoxFromLargerAndSmallerOnesWhereItsEdgesAreSeen) {
  const Believed right(test::kBrick, test::kBrick, {});
  EXPECT_LT(size_hold(right.evidence), test::kLimits.min_weakest_direction);
  EXPECT_GT(right.lead(), 3.0 * test::kLimits.min_contrast);
  // A model a tenth too small or too large loses to the box that is there.
  EXPECT_LT(Believed(test::kBrick, test::kBrick / 1.1, {}).lead(), 0.0);
  EXPECT_LT(Believed(test::kBrick, test::kBrick / 0.9, {}).lead(), 0.0);
}

// The corner that is seen lies right, and the far edges are but a twentieth off.
TEST(SizeLead, TellsABoxFromOneALittleSmaller) {
  EXPECT_LT(Believed(0.95 * test::kBrick, test::kBrick, {}).lead(), 0.0);
  EXPECT_LT(Believed(1.05 * test::kBrick, test::kBrick, {}).lead(), 0.0);
}

// A screen before the box with a window in which its nearest corner is seen, but no other.
TEST(SizeLead, IsNoneWhereTheFarEdgesAreHidden) {
  const std::vector<TriangleMesh> screen{
      test::plate_at({200, 400, 1}, {-110, 0, 300}), test::plate_at({200, 400, 1}, {110, 0, 300}),
      test::plate_at({20, 190, 1}, {0, -105, 300}), test::plate_at({20, 190, 1}, {0, 105, 300})};
  const Believed right(test::kBrick, test::kBrick, screen);
  EXPECT_GT(right.evidence.explained_samples, 100U);
  EXPECT_LT(size_hold(right.evidence), test::kLimits.min_weakest_direction);
  EXPECT_LT(right.lead(), test::kLimits.min_contrast);
}

// Of the rounded side of a can, a part is in sight, and of its upper rim: a can a third larger, laid onto them, loses.
TEST(SizeLead, TellsARoundPartFromWhatIsMuchSmaller) {
  const auto upright = [](double radius, double height) {
    Pose scan_from_model(Eigen::AngleAxisd(0.5 * std::numbers::pi, Eigen::Vector3d::UnitX()));
    scan_from_model.translation() = Eigen::Vector3d(0, 0.5 * height - 75, 600 + radius);
    return scan_from_model;
  };
  const std::vector<TriangleMesh> screens{test::plate_at({400, 200, 1}, {0, 100 + 15, 400}),
                                          test::plate_at({200, 400, 1}, {-100 - 12, 0, 410})};
  const test::Asked wrong(test::prepared(simulate::cylinder(60.0, 200.0)), upright(60.0, 200.0).inverse(),
                          test::with(screens, simulate::cylinder(45.0, 150.0), upright(45.0, 150.0)), 0.25);
  EXPECT_LT(size_hold(wrong.evidence), test::kLimits.min_weakest_direction);
  EXPECT_LT(size_lead(wrong.model_from_scan, wrong.evidence, wrong.model, *wrong.seen_by, wrong.options), 0.0);
  const test::Asked right(test::prepared(simulate::cylinder(60.0, 200.0)), upright(60.0, 200.0).inverse(),
                          test::with(screens, simulate::cylinder(60.0, 200.0), upright(60.0, 200.0)), 0.25);
  EXPECT_GT(size_lead(right.model_from_scan, right.evidence, right.model, *right.seen_by, right.options),
            test::kLimits.min_contrast);
}

TEST(SizedPose, KeepsItsFixedPointAndScalesAllDistancesFromIt) {
  const Pose model_from_scan = test::pose_at({30, -20, 600}).inverse();
  const Eigen::Vector3d fixed(5, 6, 7), other(25, -4, 9);
  const SizedPose larger(model_from_scan, 1.25, fixed);
  EXPECT_LT((larger.scan_from_model() * fixed - model_from_scan.inverse() * fixed).norm(), 1e-9);
  EXPECT_NEAR((larger.scan_from_model() * other - larger.scan_from_model() * fixed).norm(),
              1.25 * (other - fixed).norm(), 1e-9);
  EXPECT_LT((larger.in_model(larger.scan_from_model() * other) - other).norm(), 1e-9);
}

}  // namespace
}  // namespace asbuilt::verify
