// SPDX-License-Identifier: Apache-2.0
#include "parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "asbuilt/model/surface_distance.h"
#include "self_match.h"

namespace asbuilt::bench {
namespace {

// The largest distance from the part, in diameters, of some vertices after some of the motions.
double worst_distance(const SuitePart& part) {
  const model::SurfaceDistance surface(part.mesh);
  double worst = 0.0;
  for (std::size_t i = 0; i < part.symmetries.size(); i += 1 + part.symmetries.size() / 40) {
    for (std::size_t v = 0; v < part.mesh.vertices.size(); v += 1 + part.mesh.vertices.size() / 200) {
      const Eigen::Vector3d moved = part.symmetries[i] * part.mesh.vertices[v];
      worst = std::max(worst, std::abs(surface.nearest(moved).signed_distance) / diameter(part.mesh));
    }
  }
  return worst;
}

TEST(SuiteParts, TheirSymmetriesMapThemOntoThemselves) {
  // The cylinder is a prism of 96 sides, whose edges stand out from its faces by 0.05 % of the radius; the flange is
  // made of cells of 3 mm.
  for (const SuitePart& part : own_parts()) EXPECT_LT(worst_distance(part), 1e-3) << part.name;
}

TEST(SuiteParts, SoDoThoseOfTheCadFilesWhereTheyAre) {
  const auto parts = parts_of(std::filesystem::path(ASBUILT_DATA_DIR) / "cad");
  ASSERT_TRUE(parts) << parts.error().message;
  if (parts->empty()) GTEST_SKIP() << "no CAD files beside the checkout";
  // Half of what tells a right pose from a wrong one: the rotor's blades are thinner than that.
  for (const SuitePart& part : *parts) EXPECT_LT(worst_distance(part), 0.01) << part.name;
}

TEST(SuiteParts, OnlySymmetricOnesHaveSymmetries) {
  std::set<std::string> names;
  for (const SuitePart& part : own_parts()) {
    EXPECT_EQ(part.group == Group::symmetric, !part.symmetries.empty()) << part.name;
    EXPECT_TRUE(names.insert(part.name).second) << part.name << " twice";
  }
}

// The mirror image of the stepped block cannot be turned into the block; that of the L-profile can.
TEST(SuiteParts, WhatIsItsOwnMirrorImageIsMeasured) {
  for (const SuitePart& part : own_parts()) {
    if (part.mesh.triangles.size() > 100) continue;  // brute force
    const auto matches = self_matches(part.mesh, true, 1, Context(2));
    ASSERT_FALSE(matches.empty()) << part.name;
    EXPECT_EQ(part.is_own_mirror, matches.front().off_share < 0.05) << part.name << ": " << matches.front().off_share;
  }
}

TEST(SelfMatches, FindTheHalfTurnsOfABox) {
  for (const SuitePart& part : own_parts()) {
    if (part.name != "box") continue;
    const auto matches = self_matches(part.mesh, false, 3, Context(2));
    ASSERT_EQ(matches.size(), 3U);
    for (const SelfMatch& match : matches) {
      EXPECT_NEAR(match.angle_deg, 180.0, 1.0);
      EXPECT_LT(match.off_share, 0.01);
    }
  }
}

TEST(SuiteParts, AFolderWithoutCadGivesNone) {
  const auto parts = parts_of("no such folder");
  ASSERT_TRUE(parts);
  EXPECT_TRUE(parts->empty());
}

}  // namespace
}  // namespace asbuilt::bench
