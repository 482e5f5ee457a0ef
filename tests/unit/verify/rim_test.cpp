// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/rim.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

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

const Pose kScanFromBox = test::corner_ahead(500);

std::vector<RimProbe> probes() { return rim_probes(brick(), kReach, 3000); }

RimEvidence asked(const std::vector<TriangleMesh>& meshes_in_scan) {
  const scan::Scan scan = test::seen(meshes_in_scan);
  const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  return rim_evidence(kScanFromBox.inverse(), probes(), kReach, evidence,
                      {kDistance, std::max(kDistance, 2.5 * scan.spacing_mm)});
}

/// A larger box that shares the corner ahead.
TriangleMesh larger(double factor) {
  const Pose about_corner(Eigen::Translation3d((1.0 - factor) * 0.5 * kSize));
  return simulate::transformed(simulate::box(factor * kSize), kScanFromBox * about_corner);
}

TEST(Rim, ProbesLieInThePlaneOfAFaceAndPastItsEdge) {
  const std::vector<RimProbe> all = probes();
  ASSERT_GT(all.size(), 100U);
  for (const RimProbe& probe : all) {
    const Eigen::Vector3f way = probe.beyond - probe.on_face;
    const double reaches = std::round(static_cast<double>(way.norm()) / kReach);
    EXPECT_NEAR(way.norm(), reaches * kReach, 1e-3);
    EXPECT_GE(reaches, 1.0);
    EXPECT_LE(reaches, 3.0);
    EXPECT_NEAR(way.dot(probe.normal), 0.0, 1e-3);
    // Distance to the box, in closed form.
    const Eigen::Vector3d outside = (probe.beyond.cast<double>().cwiseAbs() - 0.5 * kSize).cwiseMax(0.0);
    EXPECT_GT(outside.norm(), 0.5 * reaches * kReach);
    EXPECT_LT(outside.norm(), reaches * kReach + 1e-3);
  }
}

TEST(Rim, OfThePartItselfIsNowhereOverrun) {
  const RimEvidence evidence = asked({simulate::transformed(simulate::box(kSize), kScanFromBox)});
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

// A round bar along z about the origin whose ends are rounded off.
TriangleMesh rounded_bar(double radius, double height, double rounding) {
  constexpr int kSegments = 48, kSteps = 6;
  std::vector<Eigen::Vector2d> profile;  // radius, z; without the two poles
  for (const double end : {-1.0, 1.0}) {
    for (int i = 0; i <= kSteps; ++i) {
      const int step = end < 0.0 ? i : kSteps - i;
      const double angle = 0.5 * std::numbers::pi * step / kSteps;
      profile.emplace_back(radius - rounding + rounding * std::sin(angle),
                           end * (0.5 * height - rounding + rounding * std::cos(angle)));
    }
  }
  TriangleMesh mesh;
  for (const Eigen::Vector2d& ring : profile) {
    for (int k = 0; k < kSegments; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / kSegments;
      mesh.vertices.push_back(Eigen::Vector3d(ring.x() * std::cos(angle), ring.x() * std::sin(angle), ring.y()));
    }
  }
  const auto at = [&](std::size_t ring, int k) {
    return static_cast<int>(ring) * kSegments + (k + kSegments) % kSegments;
  };
  const int low = static_cast<int>(mesh.vertices.size()), high = low + 1;
  mesh.vertices.emplace_back(0.0, 0.0, -0.5 * height);
  mesh.vertices.emplace_back(0.0, 0.0, 0.5 * height);
  for (int k = 0; k < kSegments; ++k) {
    mesh.triangles.emplace_back(low, at(0, k + 1), at(0, k));
    mesh.triangles.emplace_back(high, at(profile.size() - 1, k), at(profile.size() - 1, k + 1));
    for (std::size_t ring = 0; ring + 1 < profile.size(); ++ring) {
      mesh.triangles.emplace_back(at(ring, k), at(ring, k + 1), at(ring + 1, k + 1));
      mesh.triangles.emplace_back(at(ring, k), at(ring + 1, k + 1), at(ring + 1, k));
    }
  }
  return mesh;
}

// A column passed for a bar of its thickness, as long as rounded ends had no probes.
TEST(Rim, RoundedEdgesHaveOneToo) {
  const model::PreparedModel bar = test::prepared(rounded_bar(20.0, 60.0, 4.0));
  Pose scan_from_model = Pose::Identity();
  scan_from_model.linear() = rotation_from_axis_angle({1.4, 0.0, 0.0});
  scan_from_model.translation() = Eigen::Vector3d(0, 0, 500);
  const std::vector<RimProbe> all = rim_probes(bar, 3.0, 3000);
  const auto share = [&](double height) {
    const scan::Scan scan = test::seen({simulate::transformed(rounded_bar(20.0, height, 4.0), scan_from_model)});
    const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
    const RimEvidence found = rim_evidence(scan_from_model.inverse(), all, 3.0, evidence,
                                           {kDistance, std::max(kDistance, 2.5 * scan.spacing_mm)});
    EXPECT_GT(found.asked, 15U) << "without probes there: none";
    return found.overrun_share();
  };
  EXPECT_EQ(share(60.0), 0.0);
  EXPECT_GT(share(120.0), 0.3);
}

TEST(Rim, HiddenPlacesAreNotAsked) {
  const TriangleMesh screen = test::plate_at({2000, 2000, 2}, {0, 0, 200});
  const RimEvidence evidence = asked({simulate::transformed(simulate::box(kSize), kScanFromBox), screen});
  EXPECT_EQ(evidence.asked, 0U);
  EXPECT_EQ(evidence.overrun_share(), 0.0);
}

}  // namespace
}  // namespace asbuilt::verify
