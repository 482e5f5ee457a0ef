// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/pierced_plane.h"

#include <gtest/gtest.h>

#include <numbers>
#include <vector>

#include "asbuilt/verify/verify.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

const Eigen::Vector3d kBlock(100, 80, 70), kSmaller(75, 60, 40);

// The table's frame: its top at z = 0, the sensor looks down on it at 35 degrees.
const Pose kScanFromTable =
    test::pose_at({0, 0, 600}, (std::numbers::pi + 35.0 * std::numbers::pi / 180.0) * Eigen::Vector3d::UnitX());

TriangleMesh on_table(const Eigen::Vector3d& size, const Eigen::Vector3d& corner_at) {
  return simulate::transformed(simulate::box(size), kScanFromTable * Eigen::Translation3d(corner_at + 0.5 * size));
}

const TriangleMesh& table() {
  static const TriangleMesh mesh = on_table({500, 500, 4}, {-250, -250, -4});
  return mesh;
}

// Of a block believed with its least corner at a place of the table's frame, amid what was seen.
double pierced(const std::vector<TriangleMesh>& scene, const Eigen::Vector3d& corner_at) {
  static const model::PreparedModel model = test::prepared(simulate::box(kBlock));
  const scan::Scan scan = test::seen(scene, 0.45);
  const Pose scan_from_model = kScanFromTable * Eigen::Translation3d(corner_at + 0.5 * kBlock);
  return pierced_share(scan_from_model.inverse(), model, scan, 0.7);
}

TEST(PiercedPlane, IsNoneWhereTheBlockStandsOnTheTable) {
  EXPECT_EQ(pierced({table(), on_table(kBlock, {0, 0, 0})}, {0, 0, 0}), 0.0);
}

// With the top of the block on that of something lower, it ends 30 mm below the table. Compared by area, without what
// lies within 2 % of the diameter of the table.
TEST(PiercedPlane, IsTheShareOfTheBlockBelowTheTable) {
  const double below_mm = kBlock.z() - kSmaller.z() - 0.02 * kBlock.norm();
  const double round = 2.0 * (kBlock.x() + kBlock.y()), base = kBlock.x() * kBlock.y();
  const double expected = (base + round * below_mm) / (2.0 * base + round * kBlock.z());
  const double share = pierced({table(), on_table(kSmaller, {0, 0, 0})}, {0, 0, kSmaller.z() - kBlock.z()});
  EXPECT_NEAR(share, expected, 0.03);
  EXPECT_GT(share, 2.0 * VerifyOptions{}.max_pierced_share);
}

TEST(PiercedPlane, IsNoneOfWhatReachesPastTheRimOfTheTable) {
  const Eigen::Vector3d beside(-0.5 * kBlock.x(), -250 - kBlock.y() - 15, -35);
  EXPECT_EQ(pierced({table(), on_table(kBlock, beside)}, beside), 0.0);
}

TEST(PiercedPlane, IsNoneOfWhatStandsBehindABoard) {
  const Eigen::Vector3d under(-0.5 * kBlock.x(), -0.5 * kBlock.y(), -kBlock.z() - 20);
  EXPECT_EQ(pierced({table(), on_table(kBlock, under)}, under), 0.0);
}

TEST(PiercedPlane, IsNoneWithoutPlanes) { EXPECT_EQ(pierced({on_table(kBlock, {0, 0, 0})}, {0, 0, -30}), 0.0); }

}  // namespace
}  // namespace asbuilt::verify
