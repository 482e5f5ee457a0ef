// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "asbuilt/refine/view_difference.h"

namespace asbuilt::refine {

/// Which placement each view of a symmetric part takes, relative to the others.
struct SymmetryChoice {
  int reference = 0;          ///< the view that keeps its element; all others are chosen relative to it
  std::vector<int> element;   ///< one a view: the pose becomes elements[element] * pose; 0 for the reference
  std::vector<char> decided;  ///< one a view: 1 where what was built tells its element from every other
};

/// Detection knows a pose modulo the part's symmetry: the dent that makes one of six sectors different is not in the
/// CAD. So the elements of all views are chosen jointly, such that the surfaces of all pairs differ least
/// (ViewDifference::evidence, each pair fitted to one another first): best placements view by view, the clearest first,
/// from each view as reference, then changed one at a time until nothing improves. An element is decided if every other
/// one, the rest following, is worse by more than 15 and by more than what differs at the best, and lets the view share
/// at most twice as many patches with the others: where views do not meet, nothing differs. Views for which nothing
/// breaks the symmetry are not decided, whatever their element.
///
/// `elements`: a finite group, identity first (model::SymmetryGroup::elements). Pairs: all of up to 16 views, else the
/// links. Cost: pairs x elements comparisons of 5000 points. Errors: cancelled.
[[nodiscard]] Result<SymmetryChoice> choose_elements(const ComparedViews& views, std::span<const Pose> poses,
                                                     std::span<const Link> links, std::span<const Pose> elements,
                                                     const Context& context);

}  // namespace asbuilt::refine
