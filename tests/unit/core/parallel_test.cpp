// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/parallel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>
#include <stdexcept>
#include <utility>

#include "asbuilt/core/random.h"

namespace asbuilt {
namespace {

using testing::Each;

constexpr int kThreadCounts[] = {1, 2, 3, 8};

TEST(ParallelFor, VisitsEveryIndexOnce) {
  for (const int threads : kThreadCounts) {
    for (const std::size_t count : {0U, 1U, 7U, 8U, 9U, 1000U}) {
      std::vector<int> visits(count, 0);
      parallel_for(Context(threads), count, 8, [&](std::size_t i) { ++visits[i]; });
      EXPECT_THAT(visits, Each(1)) << threads << " threads, " << count << " indices";
    }
  }
}

TEST(ParallelForBlocks, CoversTheRangeWithoutGaps) {
  for (const int threads : kThreadCounts) {
    std::vector<int> visits(103, 0);
    parallel_for_blocks(Context(threads), visits.size(), 10, [&](std::size_t begin, std::size_t end) {
      EXPECT_EQ(begin % 10, 0U);
      EXPECT_LE(end - begin, 10U);
      for (std::size_t i = begin; i < end; ++i) ++visits[i];
    });
    EXPECT_THAT(visits, Each(1));
  }
}

TEST(ParallelFor, MayBeNested) {
  for (const int threads : kThreadCounts) {
    const Context context(threads);
    std::vector<std::vector<int>> visits(20, std::vector<int>(50, 0));
    parallel_for(context, visits.size(), 1, [&](std::size_t i) {
      parallel_for(context, visits[i].size(), 3, [&](std::size_t j) { ++visits[i][j]; });
    });
    EXPECT_THAT(visits, Each(Each(1)));
  }
}

TEST(ParallelFor, HandsAnExceptionToTheCaller) {
  for (const int threads : kThreadCounts) {
    const Context context(threads);
    const auto run = [&] {
      parallel_for(context, 1000, 1, [](std::size_t i) {
        if (i == 700) throw std::runtime_error("seven hundred");
      });
    };
    EXPECT_THROW(run(), std::runtime_error) << threads << " threads";
    // The threads are still usable afterwards.
    std::vector<int> visits(100, 0);
    parallel_for(context, visits.size(), 1, [&](std::size_t i) { ++visits[i]; });
    EXPECT_THAT(visits, Each(1));
  }
}

TEST(SumInFixedOrder, AddsEachBlockFromLeftToRightAndThenTheBlocks) {
  // Numbers whose sum depends on the order of the additions in the last digits.
  std::vector<double> values;
  Random random(1, "sum", 0);
  for (int i = 0; i < 1003; ++i) values.push_back(std::exp(20.0 * random.uniform(-1.0, 1.0)) * random.normal());
  double expected = 0.0;
  for (std::size_t begin = 0; begin < values.size(); begin += 10) {
    double block = 0.0;
    for (std::size_t i = begin; i < std::min(begin + 10, values.size()); ++i) block += values[i];
    expected += block;
  }
  ASSERT_NE(expected, std::accumulate(values.begin(), values.end(), 0.0)) << "the order would not show";
  for (const int threads : kThreadCounts) {
    const double sum = sum_in_fixed_order(Context(threads), values.size(), 10, 0.0,
                                          [&](double& total, std::size_t i) { total += values[i]; });
    EXPECT_EQ(sum, expected) << threads << " threads";
  }
}

TEST(SumInFixedOrder, OfNothingIsZero) {
  EXPECT_EQ(sum_in_fixed_order(Context(2), 0, 8, 0.0, [](double& total, std::size_t) { total += 1.0; }), 0.0);
}

using Entry = std::pair<int, std::size_t>;

std::vector<Entry> entries_with_many_ties(std::size_t count) {
  std::vector<Entry> entries;
  Random random(2, "sort", count);
  for (std::size_t i = 0; i < count; ++i) entries.emplace_back(static_cast<int>(random.below(50)), i);
  return entries;
}

TEST(StableParallelSort, GivesWhatTheStandardStableSortGives) {
  const auto before = [](const Entry& a, const Entry& b) { return a.first < b.first; };
  // Around the run length of the implementation (2^15), and an odd number of runs.
  for (const std::size_t count : {0U, 1U, 2U, 32767U, 32768U, 32769U, 65536U, 100001U, 200000U}) {
    std::vector<Entry> expected = entries_with_many_ties(count);
    std::stable_sort(expected.begin(), expected.end(), before);
    for (const int threads : kThreadCounts) {
      std::vector<Entry> sorted = entries_with_many_ties(count);
      stable_parallel_sort(Context(threads), sorted, before);
      EXPECT_EQ(sorted, expected) << count << " entries, " << threads << " threads";
    }
  }
}

TEST(Context, TakesAtLeastOneThread) {
  EXPECT_GE(Context().arena().threads(), 1);
  EXPECT_EQ(Context(3).arena().threads(), 3);
}

TEST(Context, WithMoreThreadsThanCoresWorksWithoutAWord) {
  testing::internal::CaptureStderr();
  std::vector<int> visits(1000, 0);
  parallel_for(Context(61), visits.size(), 1, [&](std::size_t i) { ++visits[i]; });
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_THAT(visits, Each(1));
}

TEST(Context, IsSilentWithoutCallbacks) {
  const Context context(1);
  EXPECT_NO_THROW(context.warn("nobody listens"));
  EXPECT_NO_THROW(context.report_progress(0.5));
  EXPECT_FALSE(context.cancelled());
}

TEST(Context, SeesARequestToStop) {
  std::stop_source source;
  Context context(1);
  context.stop = source.get_token();
  EXPECT_FALSE(context.cancelled());
  source.request_stop();
  EXPECT_TRUE(context.cancelled());
}

}  // namespace
}  // namespace asbuilt
