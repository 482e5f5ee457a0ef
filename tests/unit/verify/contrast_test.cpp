// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/contrast.h"

#include <gtest/gtest.h>

#include <numbers>

#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

// A plate that one deeper notch keeps from being four-fold.
const model::PreparedModel& plate() {
  static const model::PreparedModel model = test::prepared(test::notched_plate(26.0), 0.04);
  return model;
}

const Pose kScanFromModel = Pose(Eigen::Translation3d(0, 0, 600));

Pose quarter_turned() {
  return Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()) * kScanFromModel.inverse();
}

PoseContrast asked(const scan::Scan& scan, const Pose& first, const Pose& second) {
  const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  return contrast(first, second, plate(), evidence, {0.7, std::max(0.7, 2.5 * scan.spacing_mm)});
}

TriangleMesh part() { return simulate::transformed(test::notched_plate(26.0), kScanFromModel); }

// Two places of 14 x 24 mm, where one pose has the deep notch and the other has not.
TEST(Contrast, SpeaksForTheTruePoseWhereTheOtherPutsItsNotch) {
  const scan::Scan scan = test::seen({part(), test::wall()});
  const PoseContrast result = asked(scan, kScanFromModel.inverse(), quarter_turned());
  EXPECT_GT(result.for_first, 20.0);
  EXPECT_LT(result.for_second, 0.05 * result.for_first);
}

TEST(Contrast, DoesNotDependOnTheOrder) {
  const scan::Scan scan = test::seen({part(), test::wall()});
  const PoseContrast there = asked(scan, kScanFromModel.inverse(), quarter_turned());
  const PoseContrast back = asked(scan, quarter_turned(), kScanFromModel.inverse());
  EXPECT_EQ(there.for_first, back.for_second);
  EXPECT_EQ(there.for_second, back.for_first);
}

// Whoever comes first is asked by a search, and the other is spared searches by what they told.
TEST(Contrast, OfManyRivalsIsThatOfEachAlone) {
  scan::Scan scan = test::seen({part(), test::wall()});
  for (const bool has_viewpoint : {true, false}) {
    if (!has_viewpoint) scan.viewpoint = {};
    const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
    const EvidenceOptions options{0.7, std::max(0.7, 2.5 * scan.spacing_mm)};
    const Pose own = kScanFromModel.inverse();
    ContrastOf contrast_of_own(own, plate(), evidence, options);
    double total = 0.0;
    for (const double slip_mm : {1.0, -3.0, 8.0, 25.0}) {
      for (const Eigen::Vector3d& along :
           {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0.6, 0.8, 0), Eigen::Vector3d(0, 0, 1)}) {
        const Pose rival = Eigen::Translation3d(slip_mm * along) * own;
        const PoseContrast there = contrast_of_own.against(rival);
        const PoseContrast back = contrast(rival, own, plate(), evidence, options);
        EXPECT_EQ(there.for_first, back.for_second) << slip_mm << " mm, viewpoint " << has_viewpoint;
        EXPECT_EQ(there.for_second, back.for_first) << slip_mm << " mm, viewpoint " << has_viewpoint;
        total += there.total();
      }
    }
    EXPECT_GT(total, 100.0);
  }
}

TEST(Contrast, OfAPoseWithItselfIsNothing) {
  const scan::Scan scan = test::seen({part(), test::wall()});
  EXPECT_EQ(asked(scan, kScanFromModel.inverse(), kScanFromModel.inverse()).total(), 0.0);
}

TEST(Contrast, IsNothingWhereBothPlacesAreHidden) {
  // Seen from the sensor, x > 15 and y > 15 (of the part's 50) lie behind a plate each.
  const TriangleMesh right = test::plate_at({400, 800, 2}, {200 + 15 * 400.0 / 600.0, 0, 400});
  const TriangleMesh above = test::plate_at({800, 400, 2}, {0, 200 + 15 * 400.0 / 600.0, 410});
  const TriangleMesh left = test::plate_at({400, 800, 2}, {-200 - 15 * 400.0 / 600.0, 0, 420});
  const TriangleMesh below = test::plate_at({800, 400, 2}, {0, -200 - 15 * 400.0 / 600.0, 430});
  const scan::Scan scan = test::seen({part(), right, above, left, below, test::wall()});
  EXPECT_LT(asked(scan, kScanFromModel.inverse(), quarter_turned()).total(), 1.0);
}

}  // namespace
}  // namespace asbuilt::verify
