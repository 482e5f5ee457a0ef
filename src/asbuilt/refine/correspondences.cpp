// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/correspondences.h"

#include <algorithm>
#include <cmath>

#include "asbuilt/core/parallel.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kBlock = 1024;

const SampledView& view_at(std::span<const SampledView> views, int index) {
  return views[static_cast<std::size_t>(index)];
}

std::size_t searchers(const SampledView& view, bool coarse) { return coarse ? view.coarse.size() : view.points.size(); }

// Doubtful points count so little that they decide nothing where there are others, but not nothing: where two scans
// share only their rims and edges, these still hold them together.
float weight_of(const SampledView& view, std::uint32_t point) {
  constexpr float kOnBorder = 0.003F, kDoubtful = 0.01F;
  return view.is_border[point] != 0 ? kOnBorder : view.is_doubtful[point] != 0 ? kDoubtful : 1.0F;
}

std::uint32_t match_of(std::uint32_t source, const SampledView& from, const SampledView& to, const Pose& to_from_from,
                       double reach, const MatchRules& rules) {
  const Eigen::Vector3f query = (to_from_from * from.points.positions[source].cast<double>()).cast<float>();
  const auto reach_float = static_cast<float>(reach);
  KdTree::Neighbour found;
  if (rules.check_normals) {
    const Eigen::Vector3f normal = (to_from_from.linear() * from.points.normals[source].cast<double>()).cast<float>();
    found =
        to.tree->nearest_facing(query, reach_float, to.points.normals, normal, static_cast<float>(rules.min_cosine));
  } else {
    found = to.tree->nearest(query, reach_float);
  }
  if (!found.found()) return KdTree::kNone;
  return found.index;
}

struct Task {
  std::size_t edge, begin, end;
};

}  // namespace

void find_matches(std::vector<DirectedEdge>& edges, std::span<const SampledView> views, std::span<const Pose> poses,
                  const MatchRules& rules, const Context& context) {
  std::vector<std::vector<std::uint32_t>> target(edges.size());
  std::vector<Task> tasks;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const std::size_t count = searchers(view_at(views, edges[e].source), rules.coarse);
    target[e].assign(count, KdTree::kNone);
    for (std::size_t i = 0; i < count; i += kBlock) tasks.push_back({e, i, std::min(count, i + kBlock)});
  }
  const auto source_of = [&](const SampledView& view, std::size_t i) {
    return rules.coarse ? view.coarse[i] : static_cast<std::uint32_t>(i);
  };
  parallel_for(context, tasks.size(), 1, [&](std::size_t t) {
    if (context.cancelled()) return;
    const Task& task = tasks[t];
    const DirectedEdge& edge = edges[task.edge];
    const SampledView& from = view_at(views, edge.source);
    const SampledView& to = view_at(views, edge.target);
    const Pose to_from_from = poses[static_cast<std::size_t>(edge.target)].inverse(Eigen::Isometry) *
                              poses[static_cast<std::size_t>(edge.source)];
    for (std::size_t i = task.begin; i < task.end; ++i) {
      target[task.edge][i] = match_of(source_of(from, i), from, to, to_from_from, edge.reach_mm, rules);
    }
  });
  parallel_for(context, edges.size(), 1, [&](std::size_t e) {
    const SampledView& from = view_at(views, edges[e].source);
    const SampledView& to = view_at(views, edges[e].target);
    edges[e].matches.clear();
    for (std::size_t i = 0; i < target[e].size(); ++i) {
      if (target[e][i] == KdTree::kNone) continue;
      const std::uint32_t source = source_of(from, i);
      const float weight = std::min(weight_of(from, source), weight_of(to, target[e][i]));
      edges[e].matches.push_back({source, target[e][i], weight});
    }
  });
}

ResidualStatistics residual_statistics(const DirectedEdge& edge, std::span<const SampledView> views,
                                       std::span<const Pose> poses) {
  if (edge.matches.empty()) return {};
  const SampledView& from = view_at(views, edge.source);
  const SampledView& to = view_at(views, edge.target);
  const Pose to_from_from = poses[static_cast<std::size_t>(edge.target)].inverse(Eigen::Isometry) *
                            poses[static_cast<std::size_t>(edge.source)];
  std::vector<double> residuals, sines;
  for (const Match& match : edge.matches) {
    const Eigen::Vector3d p = to_from_from * from.points.positions[match.source].cast<double>();
    const Eigen::Vector3d normal_p = to_from_from.linear() * from.points.normals[match.source].cast<double>();
    const Eigen::Vector3d normal_q = to.points.normals[match.target].cast<double>();
    residuals.push_back(std::abs(normal_q.dot(p - to.points.positions[match.target].cast<double>())));
    sines.push_back(normal_p.cross(normal_q).norm());
  }
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  return {1.4826 * median(residuals), median(sines)};
}

}  // namespace asbuilt::refine
