// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "asbuilt/core/random.h"
#include "asbuilt/verify/evidence.h"
#include "unit/verify/seen.h"

namespace asbuilt::verify {
namespace {

scan::Scan thinned(const scan::Scan& scan, double share, Random& random) {
  scan::Scan rest = scan;
  rest.cloud = {};
  rest.surface_variation.clear();
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    if (random.uniform() >= share) continue;
    rest.cloud.positions.push_back(scan.cloud.positions[i]);
    rest.cloud.normals.push_back(scan.cloud.normals[i]);
    rest.surface_variation.push_back(scan.surface_variation[i]);
  }
  return rest;
}

PoseEvidence judged(const scan::Scan& scan, const model::PreparedModel& model, const Pose& pose) {
  const ScanEvidence evidence(scan, std::vector<std::uint8_t>(scan.cloud.size(), 0));
  return evidence_for(pose.inverse(), model.dense_samples, model, evidence, {1.0, 4.0});
}

// Eq. 11 asks each model point for a scan point nearby, so fewer points never explain more. That holds strictly where
// the surface is smooth within the reach; over should-be-visible samples it holds against the whole scan of a right
// pose (from a wrong pose, removing a point that contradicts it helps: docs/verify.md).
TEST(Score, NeverRisesWhenPointsOfTheScanAreRemoved) {
  const TriangleMesh ball = simulate::sphere(60.0, 5);
  const model::PreparedModel model = test::prepared(ball, 0.04);
  const Pose pose(Eigen::Translation3d(0, 0, 500));
  for (const bool with_viewpoint : {true, false}) {
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      Random random(seed, "thinning", 0);
      scan::Scan scan = test::seen({simulate::transformed(ball, pose)}, 0.15);
      if (!with_viewpoint) scan.viewpoint = {};
      const PoseEvidence whole = judged(scan, model, pose);
      EXPECT_GT(whole.score(), 0.9);
      std::size_t explained = whole.explained_anywhere;
      for (int step = 0; step < 6; ++step) {
        scan = thinned(scan, 0.6, random);
        const PoseEvidence evidence = judged(scan, model, pose);
        EXPECT_LE(evidence.explained_anywhere, explained) << "seed " << seed << ", step " << step;
        EXPECT_LE(evidence.score(), whole.score() + 1e-9) << "seed " << seed << ", step " << step;
        explained = evidence.explained_anywhere;
      }
    }
  }
}

}  // namespace
}  // namespace asbuilt::verify
