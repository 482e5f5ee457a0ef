// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/scan/sanitise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <set>
#include <tuple>

#include "asbuilt/core/random.h"

namespace asbuilt::scan {
namespace {

using testing::ElementsAre;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

PointCloud cloud_of(std::vector<Eigen::Vector3f> positions) { return {std::move(positions), {}}; }

TEST(Sanitise, CountsEveryKindOfBadPointAndKeepsTheOthersInOrder) {
  const PointCloud raw = cloud_of({{kNan, 1, 1},       // not finite
                                   {1, 2, 3},          // kept
                                   {0, 0, 0},          // no return
                                   {1, kInfinity, 0},  // not finite
                                   {-0.0F, 0, -0.0F},  // no return, whatever the signs of its zeros
                                   {1, 2, 3},          // repeats row 1
                                   {4, 5, 6},          // kept
                                   {1, 2, -kInfinity},
                                   {1, 2, 3}});  // repeats row 1
  const Sanitised clean = sanitise(raw, Context(1));
  EXPECT_EQ(clean.report.points_in, 9U);
  EXPECT_EQ(clean.report.not_finite, 3U);
  EXPECT_EQ(clean.report.no_return, 2U);
  EXPECT_EQ(clean.report.duplicates, 2U);
  EXPECT_EQ(clean.report.zero_normals, 0U);
  EXPECT_THAT(clean.source_index, ElementsAre(1U, 6U));
  EXPECT_THAT(clean.cloud.positions, ElementsAre(Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(4, 5, 6)));
  EXPECT_FALSE(clean.cloud.has_normals());
}

TEST(Sanitise, TakesPointsThatDifferInTheSignOfAZeroForTheSame) {
  const Sanitised clean = sanitise(cloud_of({{0.0F, 1, 2}, {-0.0F, 1, 2}, {3, -0.0F, 2}, {3, 0.0F, 2}}), Context(1));
  EXPECT_EQ(clean.report.duplicates, 2U);
  EXPECT_THAT(clean.source_index, ElementsAre(0U, 2U));
}

TEST(Sanitise, KeepsPointsThatDifferInTheLastBit) {
  const float next = std::nextafter(1.0F, 2.0F);
  const Sanitised clean = sanitise(cloud_of({{1, 1, 1}, {next, 1, 1}, {1, 1, next}}), Context(1));
  EXPECT_EQ(clean.report.duplicates, 0U);
  EXPECT_EQ(clean.cloud.size(), 3U);
}

TEST(Sanitise, MakesNormalsUnitLengthAndUnusableOnesZero) {
  PointCloud raw = cloud_of({{1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {0, 0, 0}});
  raw.normals = {{0, 0, 5}, {0, 0, 0}, {kNan, 0, 1}, {0, -0.5F, 0}, {0, 0, 0}};
  const Sanitised clean = sanitise(raw, Context(1));
  EXPECT_EQ(clean.report.zero_normals, 2U) << "the normal of a point that went does not count";
  EXPECT_THAT(clean.cloud.normals, ElementsAre(Eigen::Vector3f(0, 0, 1), Eigen::Vector3f(0, 0, 0),
                                               Eigen::Vector3f(0, 0, 0), Eigen::Vector3f(0, -1, 0)));
}

TEST(Sanitise, TheCountsAddUpOnARandomMixture) {
  PointCloud raw;
  std::size_t state = 1;
  for (int i = 0; i < 100000; ++i) {  // more than one block of the parallel sort
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    const auto value = static_cast<float>((state >> 33) % 40);
    raw.positions.emplace_back(value == 7.0F ? kNan : value, static_cast<float>((state >> 50) % 20), 0.0F);
  }
  const Sanitised clean = sanitise(raw, Context(2));
  const SanitiserReport& report = clean.report;
  EXPECT_EQ(report.not_finite + report.no_return + report.duplicates + clean.cloud.size(), raw.size());
  EXPECT_EQ(clean.cloud.size(), 39U * 20U - 1U) << "all but the NaNs and the origin, each once";
  for (std::size_t i = 0; i < clean.cloud.size(); ++i) {
    EXPECT_EQ(clean.cloud.positions[i], raw.positions[clean.source_index[i]]);
  }
  EXPECT_TRUE(std::ranges::is_sorted(clean.source_index));
}

TEST(Sanitise, KeepsTheFirstOfEveryRepeatAmongManyPointsWhateverTheThreads) {
  Random random(5, "many", 0);
  PointCloud raw;
  const auto coordinate = [&] { return static_cast<float>(1 + random.below(60)); };
  for (int i = 0; i < 200000; ++i) raw.positions.emplace_back(coordinate(), coordinate(), coordinate());
  std::set<std::tuple<float, float, float>> seen;
  std::vector<std::uint32_t> first;
  for (std::uint32_t i = 0; i < raw.size(); ++i) {
    const Eigen::Vector3f& p = raw.positions[i];
    if (seen.emplace(p.x(), p.y(), p.z()).second) first.push_back(i);
  }
  ASSERT_LT(first.size(), 150000U);
  for (const int threads : {1, 2, 3}) {
    EXPECT_EQ(sanitise(raw, Context(threads)).source_index, first) << threads << " threads";
  }
}

TEST(Sanitise, OfNothingIsNothing) {
  const Sanitised clean = sanitise({}, Context(1));
  EXPECT_EQ(clean.report.points_in, 0U);
  EXPECT_TRUE(clean.cloud.empty());
}

}  // namespace
}  // namespace asbuilt::scan
