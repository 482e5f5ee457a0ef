// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/lm_icp.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "asbuilt/core/random.h"
#include "asbuilt/verify/verdict.h"
#include "support/matchers.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

std::vector<Eigen::Vector3f> moved(const std::vector<Eigen::Vector3f>& points, const Pose& pose) {
  std::vector<Eigen::Vector3f> result;
  for (const Eigen::Vector3f& p : points) result.push_back((pose * p.cast<double>()).cast<float>());
  return result;
}

Vector6d random_twist(Random& random, double radians, double mm) {
  Vector6d twist;
  for (int k = 0; k < 6; ++k) twist[k] = (k < 3 ? radians : mm) * random.uniform(-1.0, 1.0);
  return twist;
}

class LmIcp : public testing::TestWithParam<TriangleMesh (*)()> {};

TEST_P(LmIcp, ConvergesFromAPercentOfTheDiameterToTheTruePose) {
  const model::PreparedModel model = test::prepared(GetParam()());
  Random random(1, "lm", 0);
  for (int trial = 0; trial < 8; ++trial) {
    const Pose scan_from_model = test::pose_at({200, -100, 700});
    const auto points = moved(model.samples.positions, scan_from_model);
    const Pose start = pose_from_twist(random_twist(random, 0.012, 0.006 * model.diameter)) * scan_from_model.inverse();
    ASSERT_GT(displacement_mm(start, scan_from_model.inverse(), model), 0.002 * model.diameter);
    const LmIcpResult result = lm_icp(points, start, model, {}, {0.05 * model.diameter, 30, false});
    // The field's grid is diameter / 400 wide; an edge is rounded by a part of that, alike on all sides.
    EXPECT_LT(displacement_mm(result.model_from_scan, scan_from_model.inverse(), model), 3e-4 * model.diameter);
    EXPECT_EQ(result.inliers, points.size());
  }
}

INSTANTIATE_TEST_SUITE_P(Parts, LmIcp, testing::Values(&test::stepped_block, &test::casing),
                         [](const auto& part) { return part.index == 0 ? "SteppedBlock" : "Casing"; });

TEST(LmIcpProperty, DoesNotCareWhereTheScanFrameLies) {
  const model::PreparedModel model = test::prepared(test::stepped_block());
  Random random(2, "lm", 0);
  const Pose start = pose_from_twist(random_twist(random, 0.01, 1.0));
  const LmIcpOptions options{5.0, 30, false};
  const Pose expected = lm_icp(model.samples.positions, start, model, {}, options).model_from_scan;
  for (int trial = 0; trial < 5; ++trial) {
    const Pose motion = pose_from_twist(random_twist(random, 3.0, 300.0));
    const auto points = moved(model.samples.positions, motion);
    const Pose found = lm_icp(points, start * motion.inverse(), model, {}, options).model_from_scan * motion;
    EXPECT_LT(displacement_mm(found, expected, model), 0.01);
  }
}

TEST(LmIcpProperty, IsNotPulledByOutliersBeyondItsScale) {
  const model::PreparedModel model = test::prepared(test::stepped_block());
  Random random(3, "lm", 0);
  std::vector<Eigen::Vector3f> points = model.samples.positions;
  for (std::size_t i = 0; i < model.samples.size(); i += 3) {  // a layer 8 mm above a part of the surface
    points.push_back(model.samples.positions[i] + 8.0F * model.samples.normals[i]);
  }
  const Pose start = pose_from_twist(random_twist(random, 0.01, 0.5));
  const Pose found = lm_icp(points, start, model, {}, {3.0, 30, false}).model_from_scan;
  EXPECT_LT(displacement_mm(found, Pose::Identity(), model), 0.05);
}

TEST(LmIcp, LeavesAPoseAloneThatNothingSupports) {
  const model::PreparedModel model = test::prepared(test::stepped_block());
  const Pose far = test::pose_at({5000, 0, 0});
  const LmIcpResult result = lm_icp(model.samples.positions, far, model, {}, {5.0, 30, false});
  EXPECT_EQ(result.inliers, 0U);
  EXPECT_THAT(result.model_from_scan, test::PoseNear(far, 1e-9, 1e-6));
  EXPECT_EQ(lm_icp({}, far, model, {}, {5.0, 30, false}).inliers, 0U);
}

}  // namespace
}  // namespace asbuilt::verify
