// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/detect/codebook.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "support/matchers.h"
#include "unit/detect/oriented_points.h"

namespace asbuilt::detect {
namespace {

std::shared_ptr<const Codebook> book_of(const model::PreparedModel& model, bool paper_mode, int threads = 2) {
  const DetectOptions options = paper_mode ? DetectOptions{}.as_published() : DetectOptions{};
  return build_codebook(model, options, Context(threads)).value();
}

// "The complete set of such features" (Sec. 3.1): all pairs are kept, not one a bucket.
TEST(Codebook, HoldsEveryOrderedPairOnceInPaperMode) {
  const auto book = book_of(test::small_model(), true);
  const std::size_t count = book->samples.size();
  ASSERT_GT(count, 100U);
  EXPECT_EQ(book->entries.size(), count * (count - 1));
  EXPECT_EQ(book->offsets.front(), 0U);
  EXPECT_EQ(book->offsets.back(), book->entries.size());
  EXPECT_EQ(book->offsets.size(), book->quantisation.bin_count() + 1);
  EXPECT_TRUE(std::ranges::is_sorted(book->offsets));
}

// A sheet may be seen from behind: its samples are there twice, once for each side, and no pair mixes the sides, which
// no viewpoint sees together.
TEST(Codebook, KnowsBothSidesOfASheet) {
  TriangleMesh sheet;  // a bent one, so that it is no plane
  sheet.vertices = {{0, 0, 0}, {60, 0, 0}, {60, 40, 0}, {0, 40, 0}, {0, 0, 50}, {0, 40, 50}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {0, 5, 4}};
  const model::PreparedModel model = model::prepare(sheet, {}, Context(2)).value();
  ASSERT_TRUE(model.is_open());
  const auto book = book_of(model, false);
  EXPECT_EQ(book->samples.size(), 2 * model.samples.size());
  EXPECT_EQ(book_of(model, true)->samples.size(), model.samples.size());
  for (std::size_t i = 0; i < model.samples.size(); ++i) {
    const std::size_t back = model.samples.size() + i;
    EXPECT_EQ(book->samples.positions[back], book->samples.positions[i]);
    EXPECT_EQ(book->samples.normals[back], -book->samples.normals[i]);
    EXPECT_FALSE(book->seen_from[i].meets(book->seen_from[back])) << i;
  }
}

// Which pairs a bucket must hold, recomputed sample by sample from the definitions.
TEST(Codebook, HasEachPairInTheBucketOfItsFeature) {
  const auto book = book_of(test::small_model(), true);
  const auto& q = book->quantisation;
  std::vector<std::vector<std::pair<std::size_t, double>>> expected(q.bin_count());
  const std::size_t count = book->samples.size();
  for (std::size_t r = 0; r < count; ++r) {
    for (std::size_t i = 0; i < count; ++i) {
      if (i == r) continue;
      const auto bin = q.bin(point_pair_feature(book->samples.positions[r], book->samples.normals[r],
                                                book->samples.positions[i], book->samples.normals[i]));
      ASSERT_NE(bin, Quantisation::kNoBin);
      const Eigen::Vector3d local =
          local_frame(book->samples.positions[r], book->samples.normals[r]) * book->samples.positions[i].cast<double>();
      expected[bin].emplace_back(r, std::atan2(local.z(), local.y()));
    }
  }
  for (std::uint32_t bin = 0; bin < q.bin_count(); ++bin) {
    const auto bucket = book->bucket(bin);
    ASSERT_EQ(bucket.size(), expected[bin].size()) << "bin " << bin;
    for (std::size_t k = 0; k < bucket.size(); ++k) {
      EXPECT_EQ(bucket[k].reference, expected[bin][k].first);
      // Stored in 1/65536 of a turn; the difference is taken around the circle. On the normal's own line any angle is
      // right, but no two samples of the block lie on one.
      const double stored = bucket[k].angle / 65536.0 * 2.0 * std::numbers::pi;
      EXPECT_NEAR(std::abs(std::remainder(stored - expected[bin][k].second, 2.0 * std::numbers::pi)), 0.0, 2e-4);
    }
    if (bucket.empty()) continue;
    EXPECT_FLOAT_EQ(book->bucket_weight[bin], 1.0F / static_cast<float>(bucket.size()));  // Eq. 8
  }
}

TEST(Codebook, WeighsBucketsByTheExponent) {
  const model::PreparedModel model = test::small_model();
  DetectOptions options;
  options.bucket_weight_exponent = 0.3;
  const auto book = build_codebook(model, options, Context(2)).value();
  for (std::uint32_t bin = 0; bin < book->quantisation.bin_count(); ++bin) {
    const auto size = static_cast<float>(book->bucket(bin).size());
    EXPECT_FLOAT_EQ(book->bucket_weight[bin], size > 0 ? std::pow(size, -0.3F) : 0.0F);
  }
}

TEST(Codebook, LeavesOutPairsThatNoViewpointSees) {
  const model::PreparedModel model = test::small_model();
  const auto book = book_of(model, false);
  const std::size_t count = book->samples.size();
  EXPECT_LT(book->entries.size(), count * (count - 1));
  // Two samples whose normals look in opposite directions are never seen together (from afar).
  const auto& q = book->quantisation;
  for (std::uint32_t bin = 0; bin < q.bin_count(); ++bin) {
    if (static_cast<int>(bin) % q.angle_bins != q.angle_bins - 1) continue;  // the last bin of angle(n_i, n_j)
    EXPECT_TRUE(book->bucket(bin).empty()) << "bin " << bin;
  }
}

// Of all pairs, those with the same sample in the same sector of the same bucket are one vote, and none is lost.
TEST(Codebook, HasOneEntryForEachSampleAndSectorOfABucket) {
  const model::PreparedModel model = test::small_model();
  DetectOptions options;
  options.joint_visibility = false;
  options.single_votes = false;
  const auto all = build_codebook(model, options, Context(2)).value();
  EXPECT_EQ(all->entries.size(), all->samples.size() * (all->samples.size() - 1));
  options.single_votes = true;
  const auto single = build_codebook(model, options, Context(2)).value();
  const auto sectors = [&](const Codebook& book, std::uint32_t bin) {
    std::multiset<std::pair<int, int>> found;
    for (const Codebook::Entry& entry : book.bucket(bin)) {
      found.emplace(entry.reference, static_cast<int>(entry.angle / 65536.0 * options.alpha_bins));
    }
    return found;
  };
  for (std::uint32_t bin = 0; bin < all->quantisation.bin_count(); ++bin) {
    const auto many = sectors(*all, bin), few = sectors(*single, bin);
    const std::set<std::pair<int, int>> distinct(many.begin(), many.end());
    EXPECT_TRUE(std::ranges::equal(few, distinct)) << "bin " << bin;
  }
  EXPECT_LT(single->entries.size(), all->entries.size());
}

TEST(Codebook, ViewMasksNeverSeeASampleFromBehind) {
  const auto book = book_of(test::small_model(), false);
  for (std::size_t i = 0; i < book->samples.size(); ++i) {
    for (int view = 0; view < ViewMask::kDirections; ++view) {
      if (!book->seen_from[i].test(view)) continue;
      EXPECT_GT(book->samples.normals[i].dot(ViewMask::directions()[static_cast<std::size_t>(view)]), 0.0F);
    }
  }
}

TEST(ViewMask, DirectionsAreUnitVectorsAndSpreadEvenly) {
  Random random(1, "views", 0);
  for (const Eigen::Vector3f& direction : ViewMask::directions()) EXPECT_NEAR(direction.norm(), 1.0, 1e-6);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3f wanted = test::random_oriented_point(random).normal;
    const auto nearest = static_cast<std::size_t>(ViewMask::nearest_direction(wanted));
    // 192 caps of equal area have a radius of 8.3 degrees; an even covering needs less than twice that.
    EXPECT_GT(ViewMask::directions()[nearest].dot(wanted), std::cos(16.6 * std::numbers::pi / 180.0));
  }
}

TEST(Codebook, IsTheSameForAnyNumberOfThreads) {
  const model::PreparedModel model = test::small_model();
  const auto book = book_of(model, false, 1);
  const auto bytes = [](const Codebook& b) {
    std::vector<std::pair<std::uint16_t, std::uint16_t>> all;
    for (const Codebook::Entry& entry : b.entries) all.emplace_back(entry.reference, entry.angle);
    return all;
  };
  for (const int threads : {2, 3}) {
    const auto other = book_of(model, false, threads);
    EXPECT_EQ(other->offsets, book->offsets);
    EXPECT_EQ(bytes(*other), bytes(*book));
    EXPECT_EQ(other->bucket_weight, book->bucket_weight);
    EXPECT_EQ(other->longest_pair, book->longest_pair);
  }
}

TEST(Codebook, NeedsThreeSamples) {
  model::PreparedModel model = test::small_model();
  model.samples.positions.resize(2);
  model.samples.normals.resize(2);
  EXPECT_THAT(build_codebook(model, {}, Context(1)), test::FailsWith(ErrorCode::not_possible));
}

}  // namespace
}  // namespace asbuilt::detect
