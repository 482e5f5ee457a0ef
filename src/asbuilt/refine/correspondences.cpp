// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/correspondences.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kBlock = 1024;
constexpr std::size_t kTogether = 1 << 18;  // searches: enough for many threads, few enough to stay near the cores

double squared(double x) { return x * x; }

const SampledView& view_at(std::span<const SampledView> views, int index) {
  return views[static_cast<std::size_t>(index)];
}

std::size_t searchers(const SampledView& view, bool coarse) { return coarse ? view.coarse.size() : view.points.size(); }

Pose target_from_source(const DirectedEdge& edge, std::span<const Pose> poses) {
  return poses[static_cast<std::size_t>(edge.target)].inverse(Eigen::Isometry) *
         poses[static_cast<std::size_t>(edge.source)];
}

// Root mean squared motion (an upper bound) of the source's points since the last search.
double moved_since(const DirectedEdge& edge, const Pose& now, const SampledView& from) {
  const Eigen::Vector3d shift = now * from.centroid - edge.target_from_source * from.centroid;
  const double turn = (now.linear() - edge.target_from_source.linear()).norm() / std::numbers::sqrt2;
  return std::hypot(shift.norm(), turn * from.radius_mm);
}

bool may_keep(const DirectedEdge& edge, const Pose& now, std::span<const SampledView> views, const MatchRules& rules) {
  // A reach that has shrunk leaves matches that the robust loss has done with already.
  return edge.searched && edge.searched_coarse == rules.coarse && edge.searched_reach_mm <= 2.0 * edge.reach_mm &&
         moved_since(edge, now, view_at(views, edge.source)) <=
             rules.keep_spacings * view_at(views, edge.target).spacing_mm;
}

// `before` is what the last search found, or kNone: the nearest point is no further than that one is now.
std::uint32_t match_of(std::uint32_t source, std::uint32_t before, const SampledView& from, const SampledView& to,
                       const Pose& to_from_from, double reach, const MatchRules& rules) {
  const Eigen::Vector3f query = (to_from_from * from.points.positions[source].cast<double>()).cast<float>();
  auto reach_float = static_cast<float>(reach);
  constexpr float kRounding = 1.0001F;  // the bound itself is still found
  const auto bound = [&] { return kRounding * (to.points.positions[before] - query).norm() + 1e-6F * reach_float; };
  if (!rules.check_normals) {
    if (before != KdTree::kNone) reach_float = std::min(reach_float, bound());
    return to.tree->nearest(query, reach_float).index;
  }
  const Eigen::Vector3f normal = (to_from_from.linear() * from.points.normals[source].cast<double>()).cast<float>();
  const auto min_cosine = static_cast<float>(rules.min_cosine);
  if (before != KdTree::kNone && to.points.normals[before].dot(normal) > min_cosine) {
    reach_float = std::min(reach_float, bound());
  }
  return to.tree->nearest_facing(query, reach_float, to.points.normals, normal, min_cosine).index;
}

float weight_of(std::uint32_t source, std::uint32_t target, const SampledView& from, const SampledView& to,
                const Pose& to_from_from, const MatchRules& rules) {
  const float weight = std::min(from.weight[source], to.weight[target]);
  if (!rules.weigh_reach || !(to.fit_radius_mm > 0.0)) return weight;
  const Eigen::Vector3f offset =
      (to_from_from * from.points.positions[source].cast<double>() - to.points.positions[target].cast<double>())
          .cast<float>();
  const float height = offset.dot(to.points.normals[target]);
  const float along = (offset.squaredNorm() - height * height) / static_cast<float>(squared(to.fit_radius_mm));
  return weight / (1.0F + along * along);
}

// The point of the face across the edge at which a face of the source ends, if the target saw both; or kNone.
std::uint32_t across_edge(std::size_t rim, const SampledView& from, const SampledView& to, const Pose& to_from_from,
                          double reach_mm) {
  constexpr float kBehind = 3.0F;         // spacings from the edge: normals are of one face alone
  constexpr float kLeastBehind = 1.5F;    // spacings
  constexpr float kAside = 2.5F;          // spacings that the face may be off the place where it is looked for
  constexpr float kSameFace = 0.9F;       // cosine
  constexpr float kFacesOutwards = 0.7F;  // cosine: the face across the edge looks out of the face that ends
  constexpr float kOtherFace = 0.6F;      // cosine
  const Eigen::Matrix3f turn = to_from_from.linear().cast<float>();
  const Eigen::Vector3f end = (to_from_from * from.rims.ends.positions[rim].cast<double>()).cast<float>();
  const Eigen::Vector3f outward = turn * from.rims.ends.normals[rim], normal = turn * from.rims.face_normals[rim];
  const auto spacing = static_cast<float>(to.spacing_mm);
  const float aside = kAside * spacing + static_cast<float>(reach_mm);
  const KdTree::Neighbour same =
      to.tree->nearest_facing(end - kBehind * spacing * outward, aside, to.points.normals, normal, kSameFace);
  if (!same.found()) return KdTree::kNone;
  const KdTree::Neighbour other =
      to.tree->nearest_facing(end - kBehind * spacing * normal, aside, to.points.normals, outward, kFacesOutwards);
  if (!other.found() || std::abs(to.points.normals[other.index].dot(normal)) > kOtherFace) return KdTree::kNone;
  if (to.on_flat_face[other.index] == 0) return KdTree::kNone;  // nobody's plane
  if (normal.dot(to.points.positions[other.index] - end) > -kLeastBehind * spacing) return KdTree::kNone;
  return other.index;
}

// A few ends by themselves are chance: each must have others that end before the same face.
void keep_companions(std::vector<Match>& matches, const PointCloud& target) {
  constexpr int kLeastTogether = 8;
  constexpr float kSameFace = 0.95F;  // cosine
  struct Face {
    Eigen::Vector3f normal;  // of the first that ends before it
    int count;
  };
  std::vector<Face> faces;  // a handful
  const auto face_of = [&](const Match& match) {
    const Eigen::Vector3f& normal = target.normals[match.target];
    return std::ranges::find_if(faces, [&](const Face& face) { return face.normal.dot(normal) > kSameFace; });
  };
  for (const Match& match : matches) {
    const auto face = face_of(match);
    if (face == faces.end()) {
      faces.push_back({target.normals[match.target], 1});
    } else {
      ++face->count;
    }
  }
  std::erase_if(matches, [&](const Match& match) { return face_of(match)->count < kLeastTogether; });
}

/// The points of some edges that look for a match, one edge after the other.
struct Searches {
  struct Range {
    std::size_t edge, begin, count;
  };
  std::vector<Match> found;    ///< so far the targets of the last search, with no weight
  std::vector<Range> of_edge;  ///< for each edge
  std::vector<Range> blocks;   ///< the same in pieces

  void clear() {
    found.clear();
    of_edge.clear();
    blocks.clear();
  }

  void add(std::size_t e, const DirectedEdge& edge, const SampledView& from, bool coarse) {
    const std::size_t count = searchers(from, coarse), first = found.size();
    auto earlier = edge.matches.begin();  // by increasing source, as what follows
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t source = coarse ? from.coarse[i] : static_cast<std::uint32_t>(i);
      while (earlier != edge.matches.end() && earlier->source < source) ++earlier;
      const bool known = earlier != edge.matches.end() && earlier->source == source;
      found.push_back({source, known ? earlier->target : KdTree::kNone, 0.0F});
    }
    of_edge.push_back({e, first, count});
    for (std::size_t i = 0; i < count; i += kBlock) blocks.push_back({e, first + i, std::min(kBlock, count - i)});
  }
};

// What may_keep() asks the next time.
void note_search(DirectedEdge& edge, const Pose& now, const MatchRules& rules) {
  edge.target_from_source = now;
  edge.searched_reach_mm = edge.reach_mm;
  edge.searched_coarse = rules.coarse;
  edge.searched = true;
}

}  // namespace

std::size_t find_matches(std::vector<DirectedEdge>& edges, std::span<const SampledView> views,
                         std::span<const Pose> poses, const MatchRules& rules, const Context& context) {
  std::vector<std::size_t> due;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const Pose now = target_from_source(edges[e], poses);
    if (may_keep(edges[e], now, views, rules)) continue;
    note_search(edges[e], now, rules);
    due.push_back(e);
  }
  // Some edges after the other, so that what is found of them takes the same memory each time.
  Searches searches;
  for (std::size_t d = 0; d < due.size();) {
    searches.clear();
    for (; d < due.size() && searches.found.size() < kTogether; ++d) {
      const DirectedEdge& edge = edges[due[d]];
      searches.add(due[d], edge, view_at(views, edge.source), rules.coarse);
    }
    parallel_for(context, searches.blocks.size(), 1, [&](std::size_t b) {
      if (context.cancelled()) return;
      const Searches::Range& block = searches.blocks[b];
      const DirectedEdge& edge = edges[block.edge];
      const SampledView& from = view_at(views, edge.source);
      const SampledView& to = view_at(views, edge.target);
      for (Match& match : std::span(searches.found).subspan(block.begin, block.count)) {
        match.target = match_of(match.source, match.target, from, to, edge.target_from_source, edge.reach_mm, rules);
        if (match.target == KdTree::kNone) continue;
        match.weight = weight_of(match.source, match.target, from, to, edge.target_from_source, rules);
      }
    });
    parallel_for(context, searches.of_edge.size(), 1, [&](std::size_t i) {
      const Searches::Range& all = searches.of_edge[i];
      std::vector<Match>& matches = edges[all.edge].matches;
      matches.clear();
      for (const Match& match : std::span(searches.found).subspan(all.begin, all.count)) {
        // Also where the search was cut short: nothing there has a weight.
        if (match.weight > 0.0F && match.target != KdTree::kNone) matches.push_back(match);
      }
    });
  }
  return due.size();
}

void find_rim_matches(std::vector<DirectedEdge>& edges, std::span<const SampledView> views, std::span<const Pose> poses,
                      const MatchRules& rules, const Context& context) {
  parallel_for(context, edges.size(), 1, [&](std::size_t e) {
    DirectedEdge& edge = edges[e];
    const Pose now = target_from_source(edge, poses);
    if (context.cancelled() || may_keep(edge, now, views, rules)) return;
    note_search(edge, now, rules);
    edge.matches.clear();
    const SampledView& from = view_at(views, edge.source);
    const SampledView& to = view_at(views, edge.target);
    if (to.on_flat_face.empty()) return;
    const double noise = squared(from.noise_sigma_mm) + squared(to.noise_sigma_mm);
    const double floor = squared(0.01 * to.spacing_mm);
    const double gap = squared(from.spacing_mm) / 12.0;  // variance of where a face ends within a spacing
    const auto weight = static_cast<float>((noise + floor) / (noise + floor + gap));
    for (std::size_t i = 0; i < from.rims.ends.size(); ++i) {
      const std::uint32_t target = across_edge(i, from, to, now, edge.reach_mm);
      if (target != KdTree::kNone) edge.matches.push_back({static_cast<std::uint32_t>(i), target, weight});
    }
    keep_companions(edge.matches, to.points);
  });
}

ResidualStatistics residual_statistics(const DirectedEdge& edge, std::span<const SampledView> views,
                                       std::span<const Pose> poses) {
  if (edge.matches.empty()) return {};
  const SampledView& from = view_at(views, edge.source);
  const SampledView& to = view_at(views, edge.target);
  const Pose to_from_from = target_from_source(edge, poses);
  std::vector<double> residuals, sines;
  // Medians of a few thousand are as good as those of all.
  constexpr std::size_t kEnough = 4000;
  const std::size_t stride = (edge.matches.size() + kEnough - 1) / kEnough;
  residuals.reserve(edge.matches.size() / stride + 1);
  sines.reserve(edge.matches.size() / stride + 1);
  for (std::size_t m = 0; m < edge.matches.size(); m += stride) {
    const Match& match = edge.matches[m];
    const Eigen::Vector3d p = to_from_from * from.points.positions[match.source].cast<double>();
    const Eigen::Vector3d normal_p = to_from_from.linear() * from.points.normals[match.source].cast<double>();
    const Eigen::Vector3d normal_q = to.points.normals[match.target].cast<double>();
    residuals.push_back(std::abs(normal_q.dot(p - to.points.positions[match.target].cast<double>())));
    sines.push_back(normal_p.cross(normal_q).norm());
  }
  return {1.4826 * median_of(std::move(residuals)), median_of(std::move(sines))};
}

RimResiduals rim_residuals(const DirectedEdge& edge, std::span<const SampledView> views, std::span<const Pose> poses,
                           double most_mm) {
  const SampledView& from = view_at(views, edge.source);
  const SampledView& to = view_at(views, edge.target);
  RimResiduals sums;
  if (from.near_rim.empty() || to.near_rim.empty()) return sums;
  const Pose to_from_from = target_from_source(edge, poses);
  for (const Match& match : edge.matches) {
    const bool beside = to.near_rim[match.target] != 0;
    if (!beside && from.near_rim[match.source] != 0) continue;
    const Eigen::Vector3d p = to_from_from * from.points.positions[match.source].cast<double>();
    const double residual =
        to.points.normals[match.target].cast<double>().dot(p - to.points.positions[match.target].cast<double>());
    if (std::abs(residual) > most_mm) continue;
    (beside ? sums.beside_mm : sums.inside_mm) += residual;
    ++(beside ? sums.beside : sums.inside);
  }
  return sums;
}

}  // namespace asbuilt::refine
