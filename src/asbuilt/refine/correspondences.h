// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/refine/sampled_view.h"

namespace asbuilt::refine {

/// A point of the source view and the point of the target view that it was found to lie on.
struct Match {
  std::uint32_t source = 0, target = 0;
  float weight = 1.0F;  ///< less where either point is doubtful, or the match reaches far along the surface
};

/// One entry A(h,k) of the paper: the points of `source` (h) against the planes of `target` (k).
struct DirectedEdge {
  int source = 0, target = 0;
  double reach_mm = 0.0;       ///< longest match
  double spread_mm = 0.0;      ///< robust scale of the residuals
  double scale_mm = 0.0;       ///< beyond it the loss is flat
  double weight = 1.0;         ///< of every residual, from the variance of the edge
  double normal_spread = 0.0;  ///< median sine between the normals of a match
  std::vector<Match> matches;  ///< by increasing source
  bool of_rims = false;        ///< sources are ends of faces of the view (rim_points.h), targets lie across the edge

  // Where they were searched; find_matches keeps them while the views have hardly moved against one another since.
  Pose target_from_source = Pose::Identity();
  double searched_reach_mm = 0.0;
  bool searched_coarse = false, searched = false;
};

struct MatchRules {
  bool coarse = false;        ///< only the thinned points of the source look for a match
  bool check_normals = true;  ///< a match faces the same way
  double min_cosine = 0.0;
  bool weigh_reach = true;     ///< a plane is believed about as far as it was fitted, and less and less beyond
  double keep_spacings = 0.0;  ///< matches are kept while the source moved by less than this, in target spacings
};

/// Finds the closest point for every source point of every edge, in the target's own frame; edges whose views have
/// hardly moved against one another keep what they have. Gives the number of edges searched. Any number of threads
/// finds the same. Stops early, with matches missing, when the context is cancelled.
std::size_t find_matches(std::vector<DirectedEdge>& edges, std::span<const SampledView> views,
                         std::span<const Pose> poses, const MatchRules& rules, const Context& context);

/// The same for edges of rims: the end of a face of the source is held against the face across that edge, where the
/// target saw both. The plane is taken some spacings behind the edge, where its normal does not lean.
void find_rim_matches(std::vector<DirectedEdge>& edges, std::span<const SampledView> views, std::span<const Pose> poses,
                      const MatchRules& rules, const Context& context);

/// Robust statistics of an edge's matches: 1.4826 x median absolute residual, and median sine between normals.
struct ResidualStatistics {
  double scale_mm = 0.0;
  double normal_spread = 0.0;
};
[[nodiscard]] ResidualStatistics residual_statistics(const DirectedEdge& edge, std::span<const SampledView> views,
                                                     std::span<const Pose> poses);

/// Sums of signed residuals: of matches with planes beside a rim of the target, and of those in which neither point is
/// beside one. What stands off further than `most_mm` is left out. Where views do not know their rims: nothing.
struct RimResiduals {
  double beside_mm = 0.0, inside_mm = 0.0;  ///< sums
  std::size_t beside = 0, inside = 0;       ///< matches
};
[[nodiscard]] RimResiduals rim_residuals(const DirectedEdge& edge, std::span<const SampledView> views,
                                         std::span<const Pose> poses, double most_mm);

}  // namespace asbuilt::refine
