// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/rim.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

const Eigen::Vector3d kSize(100, 80, 60);
constexpr double kReach = 5.0;
constexpr double kDistance = 0.7;  // that counts as on the model, mm

const model::PreparedModel& brick() {
  static const model::PreparedModel model = test::prepared(simulate::box(kSize));
  return model;
}

const Pose kScanFromModel = test::corner_ahead(500);

std::vector<RimProbe> probes() { return rim_probes(brick(), kReach, 3000); }

RimEvidence asked(const std::vector<TriangleMesh>& meshes_in_scan) {
  const scan::Scan scan = test::seen(meshes_in_scan);
  const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  return rim_evidence(kScanFromModel.inverse(), probes(), kReach, evidence,
                      {kDistance, std::max(kDistance, 2.5 * scan.spacing_mm)});
}

/// A larger box that shares the corner ahead.
TriangleMesh larger(double factor) {
  const Pose about_corner(Eigen::Translation3d((1.0 - factor) * 0.5 * kSize));
  return simulate::transformed(simulate::box(factor * kSize), kScanFromModel * about_corner);
}

TEST(Rim, ProbesLieInThePlaneOfAFaceAndPastItsEdge) {
  const std::vector<RimProbe> all = probes();
  ASSERT_GT(all.size(), 100U);
  for (const RimProbe& probe : all) {
    const Eigen::Vector3f way = probe.beyond - probe.on_face;
    EXPECT_NEAR(way.norm(), kReach, 1e-3);
    EXPECT_NEAR(way.dot(probe.normal), 0.0, 1e-3);
    // Distance to the box, in closed form.
    const Eigen::Vector3d outside = (probe.beyond.cast<double>().cwiseAbs() - 0.5 * kSize).cwiseMax(0.0);
    EXPECT_GT(outside.norm(), 0.5 * kReach);
    EXPECT_LT(outside.norm(), kReach + 1e-3);
  }
}

TEST(Rim, OfThePartItselfIsNowhereOverrun) {
  const RimEvidence evidence = asked({simulate::transformed(simulate::box(kSize), kScanFromModel)});
  EXPECT_GT(evidence.asked, 50U);
  EXPECT_EQ(evidence.overrun, 0U);
  EXPECT_EQ(evidence.overrun_share(), 0.0);
}

// Two edges of each of the three faces meet at the corner ahead and end in both boxes; past the two opposite ones,
// which are as long, the larger one goes on. Of the former fewer are asked, as measured normals are blurred at a ridge.
TEST(Rim, OfALargerCopyIsOverrunAtTheFarEdges) {
  const std::vector<RimProbe> all = probes();
  const auto far = static_cast<double>(std::ranges::count_if(all, [](const RimProbe& probe) {
    const bool is_seen = probe.normal.sum() > 0.0F;
    return is_seen && (probe.beyond.cast<double>() + 0.5 * kSize).minCoeff() < 0.0;
  }));
  const RimEvidence evidence = asked({larger(1.3)});
  EXPECT_LE(static_cast<double>(evidence.overrun), far);
  EXPECT_GT(static_cast<double>(evidence.overrun), 0.8 * far);
  EXPECT_GE(evidence.overrun_share(), 0.5);
}

TEST(Rim, HiddenPlacesAreNotAsked) {
  const TriangleMesh screen = test::plate_at({2000, 2000, 2}, {0, 0, 200});
  const RimEvidence evidence = asked({simulate::transformed(simulate::box(kSize), kScanFromModel), screen});
  EXPECT_EQ(evidence.asked, 0U);
  EXPECT_EQ(evidence.overrun_share(), 0.0);
}

}  // namespace
}  // namespace asbuilt::verify
