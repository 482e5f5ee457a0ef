// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "asbuilt/simulate/simulate.h"
#include "support/parts.h"

namespace asbuilt::simulate {
namespace {

SimulateOptions rich() {
  SimulateOptions options;
  options.scans = 3;
  options.points = 6000;
  options.clutter_objects = 4;
  options.clutter_low = 0.0;  // any will do here, and is quicker to find
  options.clutter_high = 1.0;
  options.absent_share = 0.34;
  options.decoys = 1;
  options.as_built.dents = 2;
  return options;
}

bool same(const Simulation& a, const Simulation& b) {
  if (a.as_built.vertices != b.as_built.vertices || a.scans.size() != b.scans.size()) return false;
  for (std::size_t i = 0; i < a.scans.size(); ++i) {
    const SimulatedScan &x = a.scans[i], &y = b.scans[i];
    if (x.points_in_scan != y.points_in_scan || x.labels != y.labels) return false;
    if (x.model_from_scan.has_value() != y.model_from_scan.has_value()) return false;
    if (x.model_from_scan && x.model_from_scan->matrix() != y.model_from_scan->matrix()) return false;
    if (x.occlusion != y.occlusion || x.hidden != y.hidden || x.clutter != y.clutter) return false;
  }
  return true;
}

TEST(SimulateProperty, TheNumberOfThreadsNeverShows) {
  for (const char* sensor : {"structured-light", "laser-scanner"}) {
    SimulateOptions options = rich();
    options.sensor = sensor;
    const Simulation expected = simulate(test::stepped_block(), options, Context(1)).value();
    for (const int threads : {1, 2, 3}) {
      EXPECT_TRUE(same(simulate(test::stepped_block(), options, Context(threads)).value(), expected))
          << sensor << ", " << threads << " threads";
    }
  }
}

TEST(SimulateProperty, AnotherSeedIsAnotherScene) {
  SimulateOptions options = rich();
  const Simulation first = simulate(test::stepped_block(), options, Context(2)).value();
  options.seed = 2;
  EXPECT_FALSE(same(simulate(test::stepped_block(), options, Context(2)).value(), first));
}

TEST(SimulateProperty, FurtherScansLeaveTheEarlierOnesAsTheyWere) {
  SimulateOptions options = rich();
  options.absent_share = 0.0;
  const Simulation three = simulate(test::stepped_block(), options, Context(2)).value();
  options.scans = 2;
  const Simulation two = simulate(test::stepped_block(), options, Context(2)).value();
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(two.scans[i].points_in_scan, three.scans[i].points_in_scan);
}

TEST(SimulateProperty, PosesAreRigidAndSharesAreShares) {
  for (const char* pose : {"upright", "resting", "any"}) {
    SimulateOptions options = rich();
    options.pose = pose;
    options.as_built.scale = 1.02;
    const Simulation simulation = simulate(test::stepped_block(), options, Context(2)).value();
    for (const SimulatedScan& scan : simulation.scans) {
      EXPECT_EQ(scan.points_in_scan.size(), scan.labels.size());
      EXPECT_NEAR(static_cast<double>(scan.points_in_scan.size()), options.points, 0.05 * options.points);
      for (const double share : {scan.occlusion, scan.hidden, scan.clutter}) {
        EXPECT_GE(share, 0.0);
        EXPECT_LE(share, 1.0);
      }
      if (scan.model_from_scan) {
        EXPECT_TRUE(is_rigid(scan.model_from_scan->matrix(), 1e-12));
      }
    }
  }
}

}  // namespace
}  // namespace asbuilt::simulate
