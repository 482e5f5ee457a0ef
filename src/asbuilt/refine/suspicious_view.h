// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "asbuilt/refine/link_evidence.h"
#include "asbuilt/refine/refine.h"

namespace asbuilt::refine {

/// A view that the others contradict.
struct SuspiciousView {
  int view = 0;
  double spread_mm = 0.0;         ///< median EdgeResidual::spread_mm of its edges
  double others_spread_mm = 0.0;  ///< the same of all edges it has no part in
};

/// Names the view, if there is one, whose every edge is much worse than the edges among the rest. One at a time: drop
/// it, refine again from the starting poses, ask again.
///
/// Conservative, because dropping a good scan loses data for nothing: at least three other views must agree with one
/// another (linked by edges no worse than 1.5 times the usual spread), the view needs edges to at least two of them,
/// the best of its edges must exceed twice the worst of theirs and three times the usual one, and `floor_mm` - two
/// scans of one part never agree better than spacing and noise let them; the caller knows both - is added to either
/// side.
[[nodiscard]] std::optional<SuspiciousView> suspicious_view(int view_count, std::span<const EdgeResidual> edges,
                                                            double floor_mm = 0.0);

/// A view that the others contradict, and by what: one of the two.
struct ViewAgainstOthers {
  int view = 0;
  std::optional<ContradictedView> seen_through;
  std::optional<SuspiciousView> differing;
};

/// The view that the others contradict after `refinement`, by what they saw (contradicted_view) or else by its
/// residuals (suspicious_view; the floor is the noise or a tenth of the spacing, of the coarsest view). Errors: as
/// link_evidence().
[[nodiscard]] Result<std::optional<ViewAgainstOthers>> view_against_others(std::span<const View> views,
                                                                           std::span<const Link> links,
                                                                           const Refinement& refinement,
                                                                           const Context& context);

}  // namespace asbuilt::refine
