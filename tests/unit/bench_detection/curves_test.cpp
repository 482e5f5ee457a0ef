// SPDX-License-Identifier: Apache-2.0
#include "curves.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace asbuilt::bench {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

CaseRecord scanned(double score, bool present, bool right) {
  CaseRecord record;
  record.mode = "default";
  record.group = "distinct";
  record.content = present ? "part" : "clutter";
  record.best = {true, right, std::nullopt, score};
  record.status = right ? "accepted" : "rejected";
  return record;
}

// Scores 0.9 right, 0.8 wrong, 0.7 twice (one right, one on a scan without the part); a fourth scan gave no pose.
std::vector<CaseRecord> records() {
  std::vector<CaseRecord> all{scanned(0.7, true, true), scanned(0.9, true, true), scanned(0.7, false, false),
                              scanned(0.8, true, false), scanned(0.0, true, false)};
  all.back().best.has_pose = false;
  return all;
}

double by_score(const CaseRecord& record) { return record.best.score; }

TEST(PrecisionRecall, TrustsWhatWasAcceptedBeforeWhatWasNot) {
  const Series curve = precision_recall("curve", records(), &CaseRecord::best, verified_trust);
  EXPECT_THAT(curve.x, ElementsAre(0.25, 0.5, 0.5, 0.5));
  EXPECT_THAT(curve.y, ElementsAre(1.0, 1.0, 2.0 / 3.0, 0.5));
}

TEST(PrecisionRecall, CountsWhatAThresholdLetsThrough) {
  const Series curve = precision_recall("curve", records(), &CaseRecord::best, by_score);
  EXPECT_THAT(curve.x, ElementsAre(0.25, 0.25, 0.5));
  EXPECT_THAT(curve.y, ElementsAre(1.0, 0.5, 0.5));
}

TEST(PrecisionRecall, IsEmptyWithoutScans) {
  EXPECT_TRUE(precision_recall("none", {}, &CaseRecord::best, by_score).x.empty());
}

TEST(RecallOver, SplitsTheScansWithThePartIntoEqualBins) {
  std::vector<CaseRecord> all;
  for (int i = 0; i < 8; ++i) {
    all.push_back(scanned(1.0, true, i < 5));
    all.back().hidden = 0.1 * i;
  }
  all.push_back(scanned(1.0, false, false));
  const Series series = recall_over("recall", all, &CaseRecord::hidden, 2);
  ASSERT_EQ(series.x.size(), 2U);
  EXPECT_NEAR(series.x[0], 0.15, 1e-12);
  EXPECT_NEAR(series.x[1], 0.55, 1e-12);
  EXPECT_THAT(series.y, ElementsAre(1.0, 0.25));
}

TEST(Diagrams, NameEveryModeAndAreDrawn) {
  const std::vector<Diagram> diagrams = diagrams_of(records());
  ASSERT_EQ(diagrams.size(), 4U);
  const std::string svg = to_svg(diagrams.front());
  EXPECT_THAT(svg, HasSubstr(">default<"));
  EXPECT_THAT(svg, HasSubstr("</svg>"));
}

}  // namespace
}  // namespace asbuilt::bench
