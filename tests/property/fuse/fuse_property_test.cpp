// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "property/fuse/plane_scans.h"

namespace asbuilt::fuse {
namespace {

using test::scan_of;
using test::seen_from_elsewhere;

std::vector<PosedSegment> three_scans(std::uint64_t seed) {
  return {scan_of({0, 15}, 0.5, 0.05, 0, seed), scan_of({5, 20}, 0.7, 0.1, 1, seed),
          scan_of({0, 20}, 0.6, 0.02, 2, seed)};
}

TEST(FuseProperty, IsTheSameToTheLastBitOnOneTwoAndThreeThreads) {
  const auto segments = three_scans(1);
  const Reconstruction one = fuse::fuse(segments, {}, Context(1)).value();
  for (const int threads : {2, 3}) {
    const Reconstruction many = fuse::fuse(segments, {}, Context(threads)).value();
    EXPECT_EQ(many.cloud.positions, one.cloud.positions);
    EXPECT_EQ(many.cloud.normals, one.cloud.normals);
    EXPECT_EQ(many.scan, one.scan);
    EXPECT_EQ(many.support, one.support);
    EXPECT_EQ(many.sigma_mm, one.sigma_mm);
  }
}

TEST(FuseProperty, TheOrderOfScansDoesNotMatter) {
  auto segments = three_scans(2);
  const Reconstruction expected = fuse::fuse(segments, {}, Context(2)).value();
  std::ranges::reverse(segments);
  const Reconstruction reversed = fuse::fuse(segments, {}, Context(2)).value();
  EXPECT_EQ(reversed.cloud.positions, expected.cloud.positions);
  EXPECT_EQ(reversed.scan, expected.scan);
}

TEST(FuseProperty, ScanFramesDoNotMatter) {
  const auto segments = three_scans(3);
  std::vector<PosedSegment> elsewhere;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    Vector6d twist;
    twist << 0.3, -0.8, 0.5, 10, -20, 5;
    elsewhere.push_back(seen_from_elsewhere(segments[i], pose_from_twist(twist * static_cast<double>(i + 1))));
  }
  const Reconstruction expected = fuse::fuse(segments, {}, Context(2)).value();
  const Reconstruction result = fuse::fuse(elsewhere, {}, Context(2)).value();
  // Rounding in single precision (1e-5 mm here) may tip a decision at its threshold, for a point in a hundred at most.
  EXPECT_NEAR(static_cast<double>(result.cloud.size()), static_cast<double>(expected.cloud.size()),
              0.01 * static_cast<double>(expected.cloud.size()));
}

TEST(FuseProperty, SamplesMoveAlongTheirNormalOnly) {
  auto segments = three_scans(4);  // all normals are z: x and y of every result are those of some sample
  for (PosedSegment& segment : segments) segment.noise_sigma_mm = 0.0;  // unknown: normals stay as given
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  std::vector<std::tuple<float, float>> measured;
  for (const PosedSegment& segment : segments) {
    for (const auto& p : segment.segment_in_scan.positions) measured.emplace_back(p.x(), p.y());
  }
  std::ranges::sort(measured);
  for (const auto& p : result.cloud.positions) {
    EXPECT_TRUE(std::ranges::binary_search(measured, std::tuple(p.x(), p.y())));
  }
}

TEST(FuseProperty, EveryMeasuredPlaceIsStillCovered) {
  for (std::uint64_t seed = 10; seed < 15; ++seed) {
    const auto segments = three_scans(seed);
    const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
    for (const PosedSegment& segment : segments) {
      for (std::size_t i = 0; i < segment.segment_in_scan.size(); i += 5) {
        const Eigen::Vector3f& p = segment.segment_in_scan.positions[i];
        float nearest = 1e9F;
        for (const auto& q : result.cloud.positions) nearest = std::min(nearest, (q - p).head<2>().norm());
        // A sample gives way only to one within 0.75 of its own spacing.
        EXPECT_LE(nearest, 0.75F * static_cast<float>(segment.spacing_mm) + 1e-4F);
      }
    }
  }
}

TEST(FuseProperty, MoreScansNeverMakeTheStandardErrorLarger) {
  double last = 1e9;
  for (int count = 1; count <= 6; ++count) {
    std::vector<PosedSegment> segments;
    for (int i = 0; i < count; ++i) segments.push_back(scan_of({}, 0.5, 0.1, i, 20));
    const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
    double mean = 0.0;
    for (const float sigma : result.sigma_mm)
      mean += static_cast<double>(sigma) / static_cast<double>(result.cloud.size());
    EXPECT_LT(mean, last) << count;
    last = mean;
  }
}

}  // namespace
}  // namespace asbuilt::fuse
