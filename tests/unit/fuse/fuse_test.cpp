// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/fuse/fuse.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "property/fuse/plane_scans.h"

namespace asbuilt::fuse {
namespace {

using test::Rectangle;
using test::scan_of;
using ::testing::Each;
using ::testing::HasSubstr;

double rms_height(const Reconstruction& result, double z) {
  double squares = 0.0;
  for (const auto& point : result.cloud.positions) squares += (point.z() - z) * (point.z() - z);
  return std::sqrt(squares / static_cast<double>(result.cloud.size()));
}

bool is_inside(const Eigen::Vector3f& p) { return p.x() > 2.0F && p.x() < 18.0F && p.y() > 2.0F && p.y() < 18.0F; }

TEST(Fuse, OverlappingScansBecomeOneLayer) {
  std::vector<PosedSegment> segments;
  for (int i = 0; i < 6; ++i) segments.push_back(scan_of({}, 0.5, 0.05, i, 1));
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  // One scan has 1600 samples; the others fill in no more than what its jittered lattice leaves open.
  EXPECT_GE(result.cloud.size(), 1600U);
  EXPECT_LT(result.cloud.size(), 2200U);
}

TEST(Fuse, NoiseIsAveragedAndSigmaSaysByHowMuch) {
  std::vector<PosedSegment> segments;
  for (int i = 0; i < 8; ++i) segments.push_back(scan_of({}, 0.5, 0.1, i, 2));
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  double expected = 0.0;
  for (const float sigma : result.sigma_mm) expected += static_cast<double>(sigma * sigma);
  expected = std::sqrt(expected / static_cast<double>(result.cloud.size()));
  EXPECT_LT(rms_height(result, 0.0), 0.1 / std::sqrt(8.0));
  EXPECT_NEAR(rms_height(result, 0.0) / expected, 1.0, 0.25) << "the claimed standard error is the actual one";
}

TEST(Fuse, PreciseScansCountForMore) {
  PosedSegment good = scan_of({}, 0.5, 0.01, 0, 3), bad = scan_of({}, 0.5, 0.2, 1, 3);
  for (auto& point : good.segment_in_scan.positions) point.z() = 0.0F;
  for (auto& point : bad.segment_in_scan.positions) point.z() = 0.2F;
  const Reconstruction result = fuse::fuse(std::vector<PosedSegment>{bad, good}, {}, Context(1)).value();
  // Equal densities, weights 400 : 1, so the mean stands at 0.2 / 401; a few more of the bad ones here and there.
  for (std::size_t i = 0; i < result.cloud.size(); ++i) {
    if (!is_inside(result.cloud.positions[i])) continue;
    EXPECT_NEAR(result.cloud.positions[i].z(), 0.0, 0.005);
    EXPECT_EQ(result.scan[i], 0) << "the precise scan dominates";
  }
}

TEST(Fuse, SupportIsTheNumberOfScansThatSawThePlace) {
  const std::vector<PosedSegment> segments{scan_of({0.0, 20.0}, 0.5, 0.02, 4, 4),
                                           scan_of({10.0, 30.0}, 0.5, 0.02, 7, 4)};
  for (const bool paper_mode : {false, true}) {
    FuseOptions options;
    options.paper_mode = paper_mode;
    const Reconstruction result = fuse::fuse(segments, options, Context(2)).value();
    for (std::size_t i = 0; i < result.cloud.size(); ++i) {
      const double x = result.cloud.positions[i].x();
      if (x < 8.5) {
        EXPECT_EQ(result.support[i], 1);
        EXPECT_EQ(result.scan[i], 4);
      }
      if (x > 11.5 && x < 18.5) {
        EXPECT_EQ(result.support[i], 2);
      }
      if (x > 21.5) {
        EXPECT_EQ(result.scan[i], 7);
      }
    }
  }
}

TEST(Fuse, TheSidesOfAThinPlateNeverMix) {
  // 0.1 mm thick, seen from above and below with as much noise.
  const std::vector<PosedSegment> segments{scan_of({0, 20, 20, 0.0, true}, 0.5, 0.05, 0, 5),
                                           scan_of({0, 20, 20, -0.1, false}, 0.5, 0.05, 1, 5)};
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  EXPECT_EQ(result.cloud.size(), segments[0].segment_in_scan.size() + segments[1].segment_in_scan.size());
  double up = 0.0, down = 0.0;
  for (std::size_t i = 0; i < result.cloud.size(); ++i) {
    EXPECT_EQ(result.support[i], 1);
    (result.cloud.normals[i].z() > 0 ? up : down) += result.cloud.positions[i].z() / 1600.0;
  }
  EXPECT_NEAR(up, 0.0, 0.005);
  EXPECT_NEAR(down, -0.1, 0.005);
}

TEST(Fuse, EdgesStaySharp) {
  // A right-angled ridge along y: the top at z = 0 for x < 0, the wall at x = 0 for z < 0; four scans of both.
  std::vector<PosedSegment> segments;
  for (int index = 0; index < 4; ++index) {
    PosedSegment scan = scan_of({-10.0, 0.0, 20.0}, 0.4, 0.02, index, 6);
    const PosedSegment wall = scan_of({0.0, 10.0, 20.0}, 0.4, 0.02, index, 7);
    for (const auto& p : wall.segment_in_scan.positions) {
      scan.segment_in_scan.positions.emplace_back(p.z(), p.y(), -p.x());
      scan.segment_in_scan.normals.emplace_back(1.0F, 0.0F, 0.0F);
    }
    segments.push_back(scan);
  }
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  int near_edge = 0;
  for (std::size_t i = 0; i < result.cloud.size(); ++i) {
    const Eigen::Vector3f& p = result.cloud.positions[i];
    const bool is_top = result.cloud.normals[i].z() > 0.7F;
    EXPECT_LT(std::abs(is_top ? p.z() : p.x()), 0.08F) << "four sigma of a single scan";
    EXPECT_GT(result.cloud.normals[i].maxCoeff(), 0.999F) << "no normal leans over the edge, but for a fit's noise";
    near_edge += std::hypot(p.x(), p.z()) < 0.3F;
  }
  EXPECT_GT(near_edge, 50) << "there must be something at the edge to judge";
}

TEST(Fuse, AProfileNarrowerThanItsNormalsReachStaysWhereItIs) {
  // A square bar along y, 4 mm wide, sampled every 2 mm by four scans; normals lean by 35 degrees towards the corners,
  // as plane fits over more than a face do.
  constexpr double kSigma = 0.05;
  std::vector<PosedSegment> segments(4);
  for (int index = 0; index < 4; ++index) {
    PosedSegment& scan = segments[static_cast<std::size_t>(index)];
    scan.scan_index = index;
    scan.noise_sigma_mm = kSigma;
    scan.spacing_mm = 2.0;
    Random random(static_cast<std::uint64_t>(index), "bar", 0);
    for (int side = 0; side < 4; ++side) {
      const Eigen::AngleAxisd turn(side * 0.5 * std::numbers::pi, Eigen::Vector3d::UnitY());
      for (int row = 0; row < 60; ++row) {
        for (const double across : {-1.0, 1.0}) {
          const double x = across + random.uniform(-0.6, 0.6), y = 2.0 * row + random.uniform(-0.6, 0.6);
          const double lean = across * 35.0 * std::numbers::pi / 180.0;
          const Eigen::Vector3d point(x, y, 2.0 + kSigma * random.normal());
          const Eigen::Vector3d normal(std::sin(lean), 0.0, std::cos(lean));
          scan.segment_in_scan.positions.push_back((turn * point).cast<float>());
          scan.segment_in_scan.normals.push_back((turn * normal).cast<float>());
        }
      }
    }
  }
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  double squares = 0.0;
  for (const Eigen::Vector3f& p : result.cloud.positions) {
    const double off = std::max(std::abs(p.x()), std::abs(p.z())) - 2.0;
    EXPECT_LT(std::abs(off), 6.0 * kSigma);
    squares += off * off;
  }
  EXPECT_LT(std::sqrt(squares / static_cast<double>(result.cloud.size())), 1.2 * kSigma);  // kSigma without merging
}

TEST(Fuse, ACurvedSurfaceIsNotPulledInside) {
  // Noise-free spheres of 5 mm radius at 0.5 mm: averaging heights over the tangent plane alone would sink by 0.02 mm.
  std::vector<PosedSegment> segments(4);
  for (int index = 0; index < 4; ++index) {
    PosedSegment& scan = segments[static_cast<std::size_t>(index)];
    scan.scan_index = index;
    scan.noise_sigma_mm = 0.01;
    scan.spacing_mm = 0.5;
    for (std::uint64_t i = 0; i < 1300; ++i) {
      Random random(static_cast<std::uint64_t>(index), "ball", i);
      const Eigen::Vector3d d = Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
      scan.segment_in_scan.positions.push_back((5.0 * d).cast<float>());
      scan.segment_in_scan.normals.push_back(d.cast<float>());
    }
  }
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  for (const auto& point : result.cloud.positions) EXPECT_NEAR(point.norm(), 5.0F, 1e-3F);
}

TEST(Fuse, ColourAndIntensityAreMeansByPrecision) {
  // The second scan is half as noisy, so it weighs four times as much; the third knows of neither.
  std::vector<PosedSegment> segments{scan_of({0.0, 20.0}, 0.5, 0.04, 0, 9), scan_of({0.0, 20.0}, 0.5, 0.02, 1, 9),
                                     scan_of({30.0, 50.0}, 0.5, 0.02, 2, 9)};
  segments[0].colours.assign(segments[0].segment_in_scan.size(), {200, 0, 50});
  segments[0].intensities.assign(segments[0].segment_in_scan.size(), 1.0F);
  segments[1].colours.assign(segments[1].segment_in_scan.size(), {100, 0, 150});
  segments[1].intensities.assign(segments[1].segment_in_scan.size(), 6.0F);
  const Reconstruction result = fuse::fuse(segments, {}, Context(2)).value();
  ASSERT_EQ(result.colours.size(), result.cloud.size());
  ASSERT_EQ(result.intensities.size(), result.cloud.size());
  double intensity = 0.0, red = 0.0, places = 0.0;
  for (std::size_t i = 0; i < result.cloud.size(); ++i) {
    const float x = result.cloud.positions[i].x();
    if (x > 25.0F) {
      EXPECT_EQ(result.colours[i], (Colour{0, 0, 0}));
      EXPECT_TRUE(std::isnan(result.intensities[i]));
      continue;
    }
    EXPECT_EQ(result.colours[i][1], 0);
    if (x < 2.0F || x > 18.0F) continue;  // at the rims the numbers of samples of both differ
    intensity += static_cast<double>(result.intensities[i]);
    red += result.colours[i][0];
    places += 1.0;
  }
  // Both have as many samples anywhere: (1 + 4 * 6) / 5 and (200 + 4 * 100) / 5.
  EXPECT_NEAR(intensity / places, 5.0, 0.1);
  EXPECT_NEAR(red / places, 120.0, 2.0);

  FuseOptions union_only;
  union_only.paper_mode = true;
  const Reconstruction all = fuse::fuse(segments, union_only, Context(2)).value();
  EXPECT_EQ(std::ranges::count(all.colours, Colour{200, 0, 50}),
            static_cast<std::ptrdiff_t>(segments[0].segment_in_scan.size()));
  segments[0].colours.pop_back();
  EXPECT_EQ(fuse::fuse(segments, {}, Context(1)).error().code, ErrorCode::invalid_argument);
}

TEST(Fuse, OnlyClearlyIsolatedPointsAreLeftOut) {
  PosedSegment scan = scan_of({}, 0.5, 0.02, 0, 8);
  scan.segment_in_scan.positions.emplace_back(10.0F, 10.0F, 30.0F);  // flies 60 spacings above
  scan.segment_in_scan.normals.emplace_back(0.0F, 0.0F, 1.0F);
  for (int i = 0; i < 5; ++i) {  // a small group of its own stays: it may be a pin of the part
    scan.segment_in_scan.positions.emplace_back(40.0F + 0.5F * static_cast<float>(i), 10.0F, 0.0F);
    scan.segment_in_scan.normals.emplace_back(0.0F, 0.0F, 1.0F);
  }
  const std::vector<PosedSegment> segments{scan};
  const Reconstruction result = fuse::fuse(segments, {}, Context(1)).value();
  EXPECT_EQ(result.isolated_dropped, 1U);
  EXPECT_EQ(result.cloud.size(), scan.segment_in_scan.size() - 1);
  FuseOptions keep;
  keep.drop_isolated = false;
  EXPECT_EQ(fuse::fuse(segments, keep, Context(1)).value().cloud.size(), scan.segment_in_scan.size());
}

TEST(Fuse, ACoarseScanOfItsOwnPlaceIsKeptWhole) {
  const std::vector<PosedSegment> segments{scan_of({0, 20, 20}, 0.2, 0.02, 0, 9),
                                           scan_of({40, 80, 40}, 2.0, 0.02, 1, 9)};
  const Reconstruction result = fuse::fuse(segments, {}, Context(1)).value();
  EXPECT_EQ(std::ranges::count(result.scan, 1), static_cast<std::ptrdiff_t>(segments[1].segment_in_scan.size()));
}

TEST(Fuse, PaperModeIsThePlainUnion) {
  const std::vector<PosedSegment> segments{scan_of({}, 0.5, 0.1, 0, 10), scan_of({}, 0.5, 0.1, 1, 10)};
  FuseOptions options;
  options.paper_mode = true;
  const Reconstruction result = fuse::fuse(segments, options, Context(2)).value();
  ASSERT_EQ(result.cloud.size(), 2 * segments[0].segment_in_scan.size());
  for (std::size_t i = 0; i < segments[0].segment_in_scan.size(); ++i) {
    EXPECT_EQ(result.cloud.positions[i], segments[0].segment_in_scan.positions[i]);
  }
}

TEST(Fuse, UnknownNoiseIsSaidByASigmaOfZero) {
  const std::vector<PosedSegment> segments{scan_of({}, 0.5, 0.0, 0, 11), scan_of({}, 0.5, 0.0, 1, 11)};
  EXPECT_THAT(fuse::fuse(segments, {}, Context(1)).value().sigma_mm, Each(0.0F));
}

TEST(Fuse, OnePointIsAReconstruction) {
  PosedSegment one;
  one.segment_in_scan.positions.emplace_back(1.0F, 2.0F, 3.0F);
  one.segment_in_scan.normals.emplace_back(0.0F, 0.0F, 1.0F);
  const Reconstruction result = fuse::fuse(std::vector<PosedSegment>{one}, {}, Context(1)).value();
  ASSERT_EQ(result.cloud.size(), 1U);
  EXPECT_EQ(result.cloud.positions[0], Eigen::Vector3f(1, 2, 3));
}

TEST(Fuse, BadInputIsRefusedByName) {
  const PosedSegment good = scan_of({}, 2.0, 0.1, 0, 12);
  const auto message = [](const PosedSegment& segment) {
    const auto result = fuse::fuse(std::vector<PosedSegment>{segment}, {}, Context(1));
    return result ? std::string("accepted") : result.error().message;
  };
  EXPECT_EQ(fuse::fuse({}, {}, Context(1)).error().code, ErrorCode::not_possible);
  EXPECT_EQ(fuse::fuse(std::vector<PosedSegment>{PosedSegment{}}, {}, Context(1)).error().code,
            ErrorCode::not_possible);
  PosedSegment bad = good;
  bad.segment_in_scan.normals.pop_back();
  EXPECT_THAT(message(bad), HasSubstr("normals"));
  bad = good;
  bad.scan_index = 65536;
  EXPECT_THAT(message(bad), HasSubstr("65536"));
  bad = good;
  bad.segment_in_scan.positions[2].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT(message(bad), HasSubstr("number 2"));
  bad = good;
  bad.noise_sigma_mm = -1.0;
  EXPECT_THAT(message(bad), HasSubstr("noise"));
  FuseOptions options;
  options.merge_distance_mm = -0.1;
  EXPECT_FALSE(options.validate());
  options = {};
  options.max_normal_angle_deg = 90.0;
  EXPECT_FALSE(options.validate());
}

}  // namespace
}  // namespace asbuilt::fuse
