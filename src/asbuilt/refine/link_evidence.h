// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "asbuilt/core/context.h"
#include "asbuilt/core/pose.h"
#include "asbuilt/core/result.h"
#include "asbuilt/refine/refine.h"

namespace asbuilt::refine {

/// What the lines of sight of two linked views say about each other's points.
struct LinkEvidence {
  int first = 0, second = 0;
  std::size_t agreeing = 0;       ///< points where the other sensor measured something, too
  std::size_t contradicting = 0;  ///< points that the other sensor looked straight through

  [[nodiscard]] double share() const {
    const auto all = static_cast<double>(agreeing + contradicting);
    return all > 0.0 ? static_cast<double>(contradicting) / all : 0.0;
  }
};

/// Holds the points of each view, at the given poses, against what the sensors of the linked views saw, one entry a
/// link. Residuals of closest points say little about a pose that slid along its walls or turned by a near-symmetry:
/// nearly all of its points lie on some surface of the others. But where it does not, the others saw through it.
///
/// Only points that face the other sensor count, up to 4000 a view. A view without a viewpoint sees nothing; its points
/// are still seen by the others. Errors: cancelled.
[[nodiscard]] Result<std::vector<LinkEvidence>> link_evidence(std::span<const View> views, std::span<const Pose> poses,
                                                              std::span<const Link> links, const Context& context);

/// Marks the points of each view (one byte a point: 1) that a linked view looked straight through and none measured:
/// clutter that was cut out with the part, flying points. Poses must be refined. Errors: cancelled.
[[nodiscard]] Result<std::vector<std::vector<char>>> seen_through(std::span<const View> views,
                                                                  std::span<const Pose> poses,
                                                                  std::span<const Link> links, const Context& context);

/// A view that the lines of sight of the others contradict.
struct ContradictedView {
  int view = 0;
  double share = 0.0;        ///< of its points, and of the others' before it, that were seen through
  double usual_share = 0.0;  ///< the same of the usual other view, this one left out
};

/// Names the view that is contradicted most, if that is clearly more than usual among the others: more than four times
/// their share and three points of a hundred. At least three other views must be linked to one another without it.
[[nodiscard]] std::optional<ContradictedView> contradicted_view(int view_count, std::span<const LinkEvidence> evidence);

}  // namespace asbuilt::refine
