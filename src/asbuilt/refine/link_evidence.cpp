// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/link_evidence.h"

#include <algorithm>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/voxel_grid.h"
#include "asbuilt/refine/sampled_view.h"
#include "asbuilt/scan/depth_image.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kPoints = 4000;
constexpr double kFacing = 0.5;  // cosine to the other sensor: depths of what it saw at a slant spread too far
constexpr double kToleranceInSigmas = 5.0, kToleranceInSpacings = 2.0;
constexpr std::size_t kFewest = 30;  // points that were seen through
constexpr double kTimesUsual = 4.0, kMoreThanUsual = 0.03;
constexpr int kMinOthers = 3;

struct Eye {
  std::optional<scan::DepthImage> seen;
  double tolerance_mm = 0.0;
  PointCloud probes;
};

std::vector<Eye> eyes_of(std::span<const View> views, const Context& context) {
  std::vector<Eye> eyes(views.size());
  parallel_for(context, views.size(), 1, [&](std::size_t v) {
    const PointCloud& cloud = views[v].segment_in_scan;
    if (!views[v].viewpoint.known() || cloud.empty()) return;
    const double spacing = median_spacing(cloud.positions);
    if (!(spacing > 0.0)) return;
    eyes[v].seen.emplace(cloud.positions, spacing, views[v].viewpoint);
    eyes[v].tolerance_mm = kToleranceInSigmas * views[v].noise_sigma_mm + kToleranceInSpacings * spacing;
  });
  return eyes;
}

void look(const Eye& eye, const scan::Viewpoint& viewpoint, const PointCloud& points, const Pose& eye_from_points,
          LinkEvidence& evidence) {
  if (!eye.seen) return;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d point = eye_from_points * points.positions[i].cast<double>();
    const Eigen::Vector3d normal = eye_from_points.linear() * points.normals[i].cast<double>();
    if (normal.dot(viewpoint.towards_sensor(point)) < kFacing) continue;
    const auto what = eye.seen->evidence(point, eye.tolerance_mm);
    evidence.agreeing += what == scan::DepthImage::Evidence::near ? 1 : 0;
    evidence.contradicting += what == scan::DepthImage::Evidence::free ? 1 : 0;
  }
}

void add(LinkEvidence& sum, const LinkEvidence& link) {
  sum.agreeing += link.agreeing;
  sum.contradicting += link.contradicting;
}

// All that is said of each view over its links, those to `without` (-1: nobody) left out.
std::vector<LinkEvidence> pooled(int view_count, int without, std::span<const LinkEvidence> evidence) {
  std::vector<LinkEvidence> sums(static_cast<std::size_t>(view_count));
  for (const LinkEvidence& link : evidence) {
    if (link.first == without || link.second == without) continue;
    add(sums[static_cast<std::size_t>(link.first)], link);
    add(sums[static_cast<std::size_t>(link.second)], link);
  }
  return sums;
}

int largest_group_without(int view, int view_count, std::span<const LinkEvidence> evidence) {
  DisjointSets groups(view_count);
  for (const LinkEvidence& link : evidence) {
    if (link.first != view && link.second != view) groups.unite(link.first, link.second);
  }
  return static_cast<int>(groups.by_decreasing_size().front().size());
}

}  // namespace

Result<std::vector<LinkEvidence>> link_evidence(std::span<const View> views, std::span<const Pose> poses,
                                                std::span<const Link> links, const Context& context) {
  std::vector<Eye> eyes = eyes_of(views, context);
  parallel_for(context, views.size(), 1,
               [&](std::size_t v) { eyes[v].probes = evenly_sampled(views[v].segment_in_scan, kPoints, context); });
  std::vector<LinkEvidence> evidence(links.size());
  parallel_for(context, links.size(), 1, [&](std::size_t l) {
    if (context.cancelled()) return;
    const auto a = static_cast<std::size_t>(links[l].first), b = static_cast<std::size_t>(links[l].second);
    evidence[l] = {links[l].first, links[l].second};
    const Pose b_from_a = poses[b].inverse(Eigen::Isometry) * poses[a];
    look(eyes[b], views[b].viewpoint, eyes[a].probes, b_from_a, evidence[l]);
    look(eyes[a], views[a].viewpoint, eyes[b].probes, b_from_a.inverse(Eigen::Isometry), evidence[l]);
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while the scans were held against one another");
  return evidence;
}

Result<std::vector<std::vector<char>>> seen_through(std::span<const View> views, std::span<const Pose> poses,
                                                    std::span<const Link> links, const Context& context) {
  const std::vector<Eye> eyes = eyes_of(views, context);
  std::vector<std::vector<std::size_t>> neighbours(views.size());
  for (const Link& link : links) {
    neighbours[static_cast<std::size_t>(link.first)].push_back(static_cast<std::size_t>(link.second));
    neighbours[static_cast<std::size_t>(link.second)].push_back(static_cast<std::size_t>(link.first));
  }
  std::vector<std::vector<char>> marked(views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    const PointCloud& cloud = views[v].segment_in_scan;
    marked[v].assign(cloud.size(), 0);
    parallel_for(context, cloud.size(), 1024, [&](std::size_t i) {
      bool contradicted = false;
      for (const std::size_t other : neighbours[v]) {
        if (!eyes[other].seen) continue;
        const Eigen::Vector3d point =
            poses[other].inverse(Eigen::Isometry) * (poses[v] * cloud.positions[i].cast<double>());
        const auto what = eyes[other].seen->evidence(point, eyes[other].tolerance_mm);
        if (what == scan::DepthImage::Evidence::near) return;
        contradicted = contradicted || what == scan::DepthImage::Evidence::free;
      }
      marked[v][i] = contradicted ? 1 : 0;
    });
    if (context.cancelled())
      return fail(ErrorCode::cancelled, "cancelled while the scans were held against one another");
  }
  return marked;
}

std::optional<ContradictedView> contradicted_view(int view_count, std::span<const LinkEvidence> evidence) {
  std::optional<ContradictedView> worst;
  const std::vector<LinkEvidence> all = pooled(view_count, -1, evidence);
  for (int view = 0; view < view_count; ++view) {
    const LinkEvidence own = all[static_cast<std::size_t>(view)];
    if (own.contradicting < kFewest || own.share() <= kMoreThanUsual) continue;  // whatever is usual
    const std::vector<LinkEvidence> rest = pooled(view_count, view, evidence);
    std::vector<double> others;
    for (int other = 0; other < view_count; ++other) {
      const LinkEvidence& theirs = rest[static_cast<std::size_t>(other)];
      if (other != view && theirs.agreeing > 0) others.push_back(theirs.share());
    }
    if (static_cast<int>(others.size()) < kMinOthers) continue;
    if (largest_group_without(view, view_count, evidence) < kMinOthers) continue;
    const double usual = median_of(std::move(others));
    if (own.share() <= kTimesUsual * usual + kMoreThanUsual) continue;
    if (!worst || own.share() > worst->share) worst = ContradictedView{view, own.share(), usual};
  }
  return worst;
}

}  // namespace asbuilt::refine
