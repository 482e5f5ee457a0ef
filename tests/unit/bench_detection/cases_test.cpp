// SPDX-License-Identifier: Apache-2.0
#include "cases.h"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <vector>

#include "asbuilt/simulate/parts.h"

namespace asbuilt::bench {
namespace {

// Stand-ins: what a case is does not depend on the shape.
std::vector<SuitePart> eleven_parts() {
  std::vector<SuitePart> parts;
  for (int i = 0; i < 11; ++i) {
    SuitePart part;
    part.name = std::to_string(i);
    part.family = i % 2 == 0 ? "even" : "odd";
    part.is_own_mirror = i % 3 == 0;
    part.mesh = simulate::stepped_block(100.0 + i);
    parts.push_back(part);
  }
  return parts;
}

std::vector<Case> six_hundred(std::uint64_t first) {
  const std::vector<SuitePart> parts = eleven_parts();
  std::vector<Case> cases;
  for (std::uint64_t seed = first; seed < first + 600; ++seed) cases.push_back(case_of(seed, parts, 1.0));
  return cases;
}

TEST(DetectionCases, SixHundredSeedsInARowMeetTheQuotas) {
  for (const std::uint64_t first : {std::uint64_t{1}, std::uint64_t{17}}) {
    std::map<std::size_t, int> strata, present_parts;
    std::map<Content, int> contents;
    std::set<std::string> sensors;
    for (const Case& the_case : six_hundred(first)) {
      ++contents[the_case.content];
      sensors.insert(the_case.options.sensor);
      if (the_case.content != Content::part) continue;
      ++strata[the_case.stratum];
      ++present_parts[the_case.part];
    }
    EXPECT_GE(contents[Content::part], 400);
    EXPECT_LE(contents[Content::part], 400);
    for (std::size_t stratum = 0; stratum < kStrataCount; ++stratum) EXPECT_GE(strata[stratum], 100);
    EXPECT_EQ(present_parts.size(), 11U);
    for (const auto& [part, count] : present_parts) EXPECT_GE(count, 30) << "part " << part;
    for (const Content decoy :
         {Content::clutter, Content::smaller, Content::larger, Content::mirrored, Content::family}) {
      EXPECT_GE(contents[decoy], 20) << name_of(decoy);
    }
    EXPECT_EQ(sensors.size(), 2U);
  }
}

TEST(DetectionCases, EveryPartMeetsEveryStratum) {
  std::map<std::size_t, std::set<std::size_t>> strata;
  for (const Case& the_case : six_hundred(1)) {
    if (the_case.content == Content::part) strata[the_case.part].insert(the_case.stratum);
  }
  for (const auto& [part, met] : strata) EXPECT_EQ(met.size(), kStrataCount) << "part " << part;
}

TEST(DetectionCases, AMirrorImageIsNoDecoyOfAPartThatIsItsOwn) {
  const std::vector<SuitePart> parts = eleven_parts();
  for (const Case& the_case : six_hundred(1)) {
    if (the_case.content == Content::mirrored) {
      EXPECT_FALSE(parts[the_case.part].is_own_mirror) << "seed " << the_case.seed;
    }
  }
}

TEST(DetectionCases, AllCanBeSimulatedAndStayWithinWhatTheSuitePromises) {
  for (const Case& the_case : six_hundred(1)) {
    const simulate::SimulateOptions& options = the_case.options;
    EXPECT_TRUE(options.validate()) << "seed " << the_case.seed;
    EXPECT_LE(options.as_built.warp_ratio + options.as_built.bump_height_ratio, 0.005);
    EXPECT_EQ(options.scans, 1);
  }
}

TEST(DetectionCases, TheSameSeedIsTheSameScanWhateverTheThreads) {
  const std::vector<SuitePart> parts = eleven_parts();
  const Case the_case = case_of(3, parts, 0.02);
  const auto one = scan_of(the_case, parts, Context(1)), other = scan_of(the_case, parts, Context(3));
  ASSERT_TRUE(one && other);
  EXPECT_EQ(one->points_in_scan.positions, other->points_in_scan.positions);
  EXPECT_EQ(one->hidden, other->hidden);
  EXPECT_GT(one->points_in_scan.size(), 500U);
}

TEST(DetectionCases, MostScansLieInTheStratumAskedFor) {
  const std::vector<SuitePart> parts = eleven_parts();
  int asked = 0, met = 0;
  for (std::uint64_t seed = 0; seed < 18; ++seed) {
    const Case the_case = case_of(seed, parts, 0.01);
    if (the_case.content != Content::part) continue;
    const auto scan = scan_of(the_case, parts, Context(2));
    ASSERT_TRUE(scan) << scan.error().message;
    ASSERT_TRUE(scan->model_from_scan);
    EXPECT_LE(scan->deviation_ratio, 0.006) << "seed " << seed;  // the parts of the drawn total add up to 0.005 about
    ++asked;
    met += stratum_of(scan->hidden) == the_case.stratum ? 1 : 0;
  }
  EXPECT_EQ(asked, 12);
  EXPECT_GE(met, 11);
}

TEST(DetectionCases, WithoutThePartItsDecoyIsThere) {
  const std::vector<SuitePart> parts = eleven_parts();
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Case the_case = case_of(seed, parts, 0.01);
    if (the_case.content != Content::larger) continue;
    const auto scan = scan_of(the_case, parts, Context(2));
    ASSERT_TRUE(scan) << scan.error().message;
    EXPECT_FALSE(scan->model_from_scan);
    return;
  }
  FAIL() << "no case with a larger copy";
}

}  // namespace
}  // namespace asbuilt::bench
