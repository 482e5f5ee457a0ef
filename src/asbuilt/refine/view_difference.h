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

/// How far two views of what should be one surface show different surfaces, patch by patch.
struct ViewDifference {
  std::size_t compared = 0;  ///< patches that both views measured, both ways
  std::size_t differing =
      0;                   ///< of these: those whose mean distance neither noise nor a pose error of one sigma explains
  double evidence = 0.0;   ///< of the differing ones, as a log-likelihood against "the same surface"
  double height_mm = 0.0;  ///< sum of the mean distances of the differing patches

  ViewDifference& operator+=(const ViewDifference& other);
  [[nodiscard]] double share() const {
    return compared > 0 ? static_cast<double>(differing) / static_cast<double>(compared) : 0.0;
  }
};

/// Log-likelihood by which one reading of what views show must lead over any other to be believed: a patch six standard
/// deviations off, or several weaker ones.
inline constexpr double kDecisiveEvidence = 15.0;

struct SampledView;

/// Views made ready to be compared under many relative poses. A single point says little: its noise is that of the
/// sensor. The mean over a patch of one face (5 % of the diameter and four probes wide, eight points at least) is
/// several times more exact, and shows a dent, a boss or a warp that a robust refinement passes over as outliers.
/// Points at rims and edges, and points whose counterpart lies more than 1.5 spacings to the side, do not count.
class ComparedViews {
 public:
  ComparedViews(std::span<const View> views, double diameter_mm, const Context& context);
  ~ComparedViews();
  ComparedViews(const ComparedViews&) = delete;
  ComparedViews& operator=(const ComparedViews&) = delete;

  [[nodiscard]] int count() const;
  [[nodiscard]] ViewDifference difference(int a, int b, const Pose& b_from_a) const;

  /// The pair fitted to one another from close by (point to plane, Tukey, a few steps; what the pair does not hold
  /// firmly stays): the relative pose under which difference() shows what differs in shape.
  [[nodiscard]] Pose aligned(int a, int b, const Pose& b_from_a) const;

 private:
  struct Pair {
    Eigen::Vector3d point, normal;  ///< of the source, in the target's frame; the target's normal
    double height_mm = 0.0;         ///< of the point above the target's plane
  };
  template <class Use>
  void for_each_pair(const SampledView& from, const SampledView& to, const Pose& to_from_from, const Use& use) const;
  [[nodiscard]] ViewDifference one_way(const SampledView& from, const SampledView& to, const Pose& to_from_from) const;

  std::vector<SampledView> views_;
  double diameter_mm_;
};

/// Views that show different individuals, two castings of one CAD in one pile of scans.
struct Individuals {
  std::vector<int> first, second;  ///< views, ascending; `first` has more of them (or the first of all)
  std::vector<int> undecided;      ///< views that may show either: they meet the others only where both are alike
  double share_between = 0.0;      ///< of the patches that views of both measured: differing
  double share_within = 0.0;       ///< the same among views of one individual
  double height_mm = 0.0;          ///< usual distance where they differ
};

/// Splits the linked views into two individuals if their surfaces say so: each pair is fitted to one another first; the
/// sides are those under which what differs and what does not is likeliest; believed if each has two views, and patches
/// of different sides differ four times as often as those of one and in one case of a hundred more, several of them
/// decisively. Views that share nothing decide nothing. nullopt: one individual, or fewer than four views. Errors:
/// cancelled.
[[nodiscard]] Result<std::optional<Individuals>> two_individuals(const ComparedViews& views,
                                                                 std::span<const Pose> poses,
                                                                 std::span<const Link> links, const Context& context);

}  // namespace asbuilt::refine
