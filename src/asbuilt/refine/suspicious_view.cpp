// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/suspicious_view.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/median.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kMinCandidates = 50;  // fewer say nothing about an edge
constexpr double kWorseThanUsual = 3.0, kWorseThanWorst = 2.0, kConsistent = 1.5;
constexpr int kMinOthers = 3, kMinNeighbours = 2;
constexpr double kAgreeInSpacings = 0.1;  // two scans of one part never agree better than that, nor than the noise

// Size of the largest group of views, `without` left out, that edges of at most `limit` hold together.
int largest_consistent_group(int view_count, std::span<const EdgeResidual> edges, int without, double limit) {
  DisjointSets groups(view_count);
  for (const EdgeResidual& edge : edges) {
    if (edge.first == without || edge.second == without || edge.candidates < kMinCandidates) continue;
    if (edge.spread_mm <= limit) groups.unite(edge.first, edge.second);
  }
  return static_cast<int>(groups.by_decreasing_size().front().size());
}

std::optional<SuspiciousView> judge(int view, int view_count, std::span<const EdgeResidual> edges, double floor_mm) {
  std::vector<double> own, others;
  std::set<int> neighbours;
  for (const EdgeResidual& edge : edges) {
    if (edge.candidates < kMinCandidates) continue;
    const bool takes_part = edge.first == view || edge.second == view;
    (takes_part ? own : others).push_back(edge.spread_mm);
    if (takes_part) neighbours.insert(edge.first == view ? edge.second : edge.first);
  }
  if (static_cast<int>(neighbours.size()) < kMinNeighbours || others.empty()) return std::nullopt;
  const double usual = median_of(others) + floor_mm;
  const double best_own = *std::ranges::min_element(own) + floor_mm;
  const double worst_other = *std::ranges::max_element(others) + floor_mm;
  if (best_own <= kWorseThanUsual * usual || best_own <= kWorseThanWorst * worst_other) return std::nullopt;
  if (largest_consistent_group(view_count, edges, view, kConsistent * usual) < kMinOthers) return std::nullopt;
  return SuspiciousView{view, median_of(own), median_of(others)};
}

}  // namespace

std::optional<SuspiciousView> suspicious_view(int view_count, std::span<const EdgeResidual> edges, double floor_mm) {
  std::optional<SuspiciousView> worst;
  for (int view = 0; view < view_count; ++view) {
    const auto judged = judge(view, view_count, edges, floor_mm);
    if (judged && (!worst || judged->spread_mm > worst->spread_mm)) worst = judged;
  }
  return worst;
}

Result<std::optional<ViewAgainstOthers>> view_against_others(std::span<const View> views, std::span<const Link> links,
                                                             const Refinement& refinement, const Context& context) {
  const auto count = static_cast<int>(views.size());
  std::optional<ViewAgainstOthers> found;
  ASBUILT_TRY(evidence, link_evidence(views, refinement.model_from_scan, links, context));
  if (const auto seen_through = contradicted_view(count, evidence)) {
    found = ViewAgainstOthers{seen_through->view, seen_through, std::nullopt};
    return found;
  }
  double floor_mm = 0.0;
  for (const View& view : views)
    floor_mm = std::max({floor_mm, view.noise_sigma_mm, kAgreeInSpacings * view.spacing_mm});
  if (const auto differing = suspicious_view(count, refinement.edges, floor_mm)) {
    found = ViewAgainstOthers{differing->view, std::nullopt, differing};
  }
  return found;
}

}  // namespace asbuilt::refine
