// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/slip.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "asbuilt/verify/near_poses.h"
#include "asbuilt/verify/verdict.h"
#include "asbuilt/verify/verify.h"
#include "unit/verify/asked.h"

namespace asbuilt::verify {
namespace {

/// A part in a scan, asked at its true pose.
struct Asked : test::Asked {
  Asked(const TriangleMesh& mesh, const Pose& scan_from_model, const std::vector<TriangleMesh>& others,
        double half_width)
      : test::Asked(test::prepared(mesh), scan_from_model.inverse(), test::with(others, mesh, scan_from_model),
                    half_width) {}
  [[nodiscard]] double lead(double min_held = VerifyOptions().min_weakest_direction) const {
    return slip(min_held).lead_over_it;
  }
  [[nodiscard]] Slip slip(double min_held) const {
    ContrastOf contrast(model_from_scan, model, *seen_by, options);
    return strongest_slip(model_from_scan, evidence, model, min_held, 0.03 * model.diameter, contrast);
  }
  [[nodiscard]] double weakest() const { return weakest_direction(evidence, model, false); }
};

constexpr double kEveryDirection = std::numeric_limits<double>::infinity();

// Where a box moves most is a corner; the samples that are asked lie next to it.
TEST(Slip, PosesMoveTheSurfaceByTheGivenWayBothWays) {
  const Asked brick(simulate::box(test::kBrick), test::corner_ahead(500), {}, 0.25);
  const auto slipped =
      slipped_poses(brick.model_from_scan, brick.evidence, brick.model, kEveryDirection, 4.0, Slips::single);
  ASSERT_EQ(slipped.size(), 6U);
  for (const Pose& pose : slipped) EXPECT_NEAR(displacement_mm(pose, brick.model_from_scan, brick.model), 4.2, 0.25);
  for (std::size_t i = 0; i < slipped.size() / 2; ++i) {
    EXPECT_NEAR(displacement_mm(slipped[i], slipped[slipped.size() - 1 - i], brick.model), 8.4, 0.5);
  }
}

TEST(Slip, ABoxThatShowsThreeFacesIsHeldByThem) {
  const Asked brick(simulate::box(test::kBrick), test::corner_ahead(500), {}, 0.25);
  EXPECT_GT(brick.weakest(), test::kLimits.min_weakest_direction);
  EXPECT_GT(brick.lead(kEveryDirection), test::kLimits.min_contrast);
}

TEST(Slip, DirectionsThatTheSurfaceHoldsAreNotTried) {
  const Asked brick(simulate::box(test::kBrick), test::corner_ahead(500), {}, 0.25);
  EXPECT_TRUE(slipped_poses(brick.model_from_scan, brick.evidence, brick.model, test::kLimits.min_weakest_direction,
                            4.0, Slips::single)
                  .empty());
  const Asked slab(simulate::box({400, 400, 40}), Pose(Eigen::Translation3d(0, 0, 500)), {}, 0.25);
  const auto slipped = slipped_poses(slab.model_from_scan, slab.evidence, slab.model,
                                     test::kLimits.min_weakest_direction, 4.0, Slips::single);
  EXPECT_EQ(slipped.size(), 6U) << "two shifts along the face and the turn in it, both ways";
  EXPECT_EQ(slipped_poses(slab.model_from_scan, slab.evidence, slab.model, test::kLimits.min_weakest_direction, 4.0,
                          Slips::combined)
                .size(),
            26U)
      << "and all their sums and differences";
  EXPECT_EQ(loose_directions(slab.evidence, slab.model, test::kLimits.min_weakest_direction), 3);
}

// Any three motions span those that a plane leaves free; its edges are met along these.
TEST(Slip, AFaceSlipsAlongTheAxesOfItsBoxOrTurnsInItself) {
  Pose turned(Eigen::Translation3d(0, 0, 500));
  turned.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
  const Asked slab(simulate::box({400, 300, 40}), turned, {}, 0.25);
  int along_x = 0, along_y = 0, turns = 0;
  for (const Pose& pose : slipped_poses(slab.model_from_scan, slab.evidence, slab.model,
                                        test::kLimits.min_weakest_direction, 4.0, Slips::single)) {
    const Pose motion = pose * slab.model_from_scan.inverse();
    const Eigen::AngleAxisd turn(motion.linear());
    const Eigen::Vector3d shift = motion * slab.model.box.center().eval() - slab.model.box.center();
    if (turn.angle() > 1e-3) {
      ++turns;
      EXPECT_NEAR(std::abs(turn.axis().z()), 1.0, 1e-2);
      EXPECT_LT(shift.norm(), 0.1);
    } else {
      along_x += std::abs(shift.x()) > 0.999 * shift.norm() ? 1 : 0;
      along_y += std::abs(shift.y()) > 0.999 * shift.norm() ? 1 : 0;
    }
  }
  EXPECT_EQ(turns, 2);
  EXPECT_EQ(along_x, 2);
  EXPECT_EQ(along_y, 2);
}

// The field of view ends on the face, so that nothing but a plane is seen.
TEST(Slip, AFaceWithoutItsEdgesHoldsNothing) {
  const Asked slab(simulate::box({400, 400, 40}), Pose(Eigen::Translation3d(0, 0, 500)), {}, 0.25);
  EXPECT_LT(slab.weakest(), test::kLimits.min_weakest_direction);
  EXPECT_LE(slab.lead(), 0.0);
}

// A long beam, two faces of it turned to the sensor, its ends square to the view: they return nothing, but the wall
// behind shows where the beam stops. Along it the surface says nothing.
Pose beam_from_above() {
  Pose pose(Eigen::AngleAxisd(0.785, Eigen::Vector3d::UnitX()));
  pose.translation() = Eigen::Vector3d(0, 0, 700);
  return pose;
}
TriangleMesh beam(double length) { return simulate::box({length, 40, 30}); }

TEST(Slip, ABeamWhoseEndsAreSeenAsSilhouettesIsHeldByThem) {
  const Asked seen(beam(300), beam_from_above(), {test::plate_at({2000, 2000, 10}, {0, 0, 1000})}, 0.4);
  EXPECT_LT(seen.weakest(), test::kLimits.min_weakest_direction);
  EXPECT_GT(seen.lead(), test::kLimits.min_contrast);
}

TEST(Slip, ABeamThatReachesOutOfTheFieldOfViewIsNot) {
  const Asked seen(beam(1000), beam_from_above(), {test::plate_at({2000, 2000, 10}, {0, 0, 1000})}, 0.4);
  EXPECT_LT(seen.weakest(), test::kLimits.min_weakest_direction);
  EXPECT_LT(seen.lead(), test::kLimits.min_contrast);
}

TEST(Slip, ABeamThatHasDriftedSettlesBetweenItsEnds) {
  const Asked seen(beam(300), beam_from_above(), {test::plate_at({2000, 2000, 10}, {0, 0, 1000})}, 0.4);
  for (const double drift_mm : {-25.0, -3.0, 2.0, 12.0, 20.0}) {
    const Pose drifted = Eigen::Translation3d(drift_mm, 0, 0) * seen.model_from_scan;
    const PoseEvidence evidence =
        evidence_for(drifted, seen.model.dense_samples, seen.model, *seen.seen_by, seen.options);
    const Pose settled = settled_between_edges(drifted, evidence, seen.model, test::kLimits.min_weakest_direction,
                                               *seen.seen_by, seen.options);
    EXPECT_LT(displacement_mm(settled, seen.model_from_scan, seen.model), 0.01 * seen.model.diameter) << drift_mm;
  }
}

TEST(Slip, WhatTheSurfaceHoldsIsNotMovedByItsEdges) {
  const Asked brick(simulate::box(test::kBrick), test::corner_ahead(500), {}, 0.25);
  const Pose settled = settled_between_edges(brick.model_from_scan, brick.evidence, brick.model,
                                             test::kLimits.min_weakest_direction, *brick.seen_by, brick.options);
  EXPECT_TRUE(settled.isApprox(brick.model_from_scan));
}

}  // namespace
}  // namespace asbuilt::verify
