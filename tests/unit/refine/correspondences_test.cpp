// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/correspondences.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "asbuilt/refine/refine.h"

namespace asbuilt::refine {
namespace {

// 61 by 61 points of a plane, 1 mm apart; `lift_mm` is added to what lies within 4 mm of its border.
PointCloud plate(double lift_mm) {
  PointCloud cloud;
  for (int x = 0; x <= 60; ++x) {
    for (int y = 0; y <= 60; ++y) {
      const bool near = std::min({x, y, 60 - x, 60 - y}) <= 4;
      cloud.positions.emplace_back(static_cast<float>(x), static_cast<float>(y),
                                   static_cast<float>(near ? lift_mm : 0.0));
      cloud.normals.push_back(Eigen::Vector3f::UnitZ());
    }
  }
  return cloud;
}

std::vector<SampledView> two_views(double lift_mm) {
  SamplingRules rules;
  rules.face_normals = false;
  std::vector<SampledView> views;
  views.push_back(sampled_view(plate(0.0), 0.1, rules, Context(1)));
  views.push_back(sampled_view(plate(lift_mm), 0.1, rules, Context(1)));
  return views;
}

// Every point matched with its twin.
DirectedEdge edge_of_twins(std::size_t points) {
  DirectedEdge edge;
  edge.source = 0;
  edge.target = 1;
  for (std::uint32_t i = 0; i < points; ++i) edge.matches.push_back({i, i});
  return edge;
}

TEST(RimResiduals, TellWhatPlanesBesideRimsStandOff) {
  const std::vector<SampledView> views = two_views(-0.05);
  const std::vector<Pose> poses(2, Pose::Identity());
  const RimResiduals sums = rim_residuals(edge_of_twins(61 * 61), views, poses, 1.0);
  // Five rows from each border are lowered. The sixth is beside a rim of the source, which is no lower, and not of the
  // target.
  EXPECT_EQ(sums.beside, 61U * 61U - 51U * 51U);
  EXPECT_EQ(sums.inside, 49U * 49U);
  EXPECT_EQ(sums.inside_mm, 0.0);
  EXPECT_NEAR(sums.beside_mm, 0.05 * (61.0 * 61.0 - 51.0 * 51.0), 1e-3);
}

TEST(RimResiduals, LeaveOutWhatIsFarOffAndViewsWithoutRims) {
  std::vector<SampledView> views = two_views(-0.05);
  const std::vector<Pose> poses(2, Pose::Identity());
  const RimResiduals clipped = rim_residuals(edge_of_twins(61 * 61), views, poses, 0.02);
  EXPECT_EQ(clipped.beside_mm, 0.0);
  EXPECT_GT(clipped.inside, 0U);
  views[0].near_rim.clear();
  const RimResiduals none = rim_residuals(edge_of_twins(61 * 61), views, poses, 1.0);
  EXPECT_EQ(none.beside + none.inside, 0U);
}

// A view of a dome whose outermost 4 mm are bent up, as a depth camera bends silhouettes, against one that saw further:
// rims that stand off do not move it. `bend_mm` at the rim.
double height_of_dome(double bend_mm, bool rim_weights = true) {
  std::vector<View> views(2);
  for (int x = -45; x <= 45; ++x) {
    for (int y = -45; y <= 45; ++y) {
      const double r = std::hypot(x, y);
      const Eigen::Vector3d normal = Eigen::Vector3d(x, y, std::sqrt(10000.0 - r * r)) / 100.0;
      for (std::size_t v = 0; v < 2; ++v) {
        const double rim = v == 0 ? 45.0 : 30.0;
        if (r > rim) continue;
        const double off = v == 1 && r > rim - 4.0 ? bend_mm : 0.0;
        views[v].segment_in_scan.positions.push_back(((100.0 + off) * normal).cast<float>());
        views[v].segment_in_scan.normals.push_back(normal.cast<float>());
        views[v].noise_sigma_mm = 0.1;
      }
    }
  }
  const std::vector<Link> links{{0, 1}};
  RefineOptions options;
  options.rim_weights = rim_weights;
  const Refinement result = refine(views, links, options, Context(2)).value();
  return (result.model_from_scan[0].inverse() * result.model_from_scan[1] * Eigen::Vector3d(0, 0, 100)).z() - 100.0;
}

TEST(RimResiduals, KeepBentRimsFromMovingAView) {
  EXPECT_NEAR(height_of_dome(0.0), 0.0, 0.005);
  EXPECT_NEAR(height_of_dome(0.1), 0.0, 0.006);
  EXPECT_GT(std::abs(height_of_dome(0.1, false)), 0.012) << "counted in full, a quarter of the points are 0.1 mm off";
}

}  // namespace
}  // namespace asbuilt::refine
