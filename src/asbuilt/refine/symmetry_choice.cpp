// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/symmetry_choice.h"

#include <algorithm>
#include <limits>

#include "asbuilt/core/parallel.h"

namespace asbuilt::refine {
namespace {

constexpr int kAllPairsUpTo = 16;

// Index of the element that is elements[b]^-1 * elements[a].
std::vector<std::vector<std::size_t>> quotients(std::span<const Pose> elements) {
  const std::size_t count = elements.size();
  std::vector<std::vector<std::size_t>> table(count, std::vector<std::size_t>(count, 0));
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = 0; b < count; ++b) {
      const Eigen::Matrix3d rotation = elements[b].linear().transpose() * elements[a].linear();
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t e = 0; e < count; ++e) {
        const double off = (elements[e].linear() - rotation).norm();
        if (off >= least) continue;
        least = off;
        table[a][b] = e;
      }
    }
  }
  return table;
}

struct Comparison {
  std::size_t a = 0, b = 0;
  std::vector<double> evidence{};       // that they differ, by the element between them
  std::vector<std::size_t> compared{};  // patches that both measured then
};

class Choice {
 public:
  Choice(std::size_t views, std::size_t elements, std::vector<std::vector<std::size_t>> between,
         std::vector<Comparison> comparisons)
      : views_(views), elements_(elements), between_(std::move(between)), comparisons_(std::move(comparisons)) {
    of_view_.resize(views);
    for (std::size_t c = 0; c < comparisons_.size(); ++c) {
      of_view_[comparisons_[c].a].push_back(c);
      of_view_[comparisons_[c].b].push_back(c);
    }
  }

  // Of view v with element e against the views that have one (-1: none yet).
  [[nodiscard]] double cost(std::size_t v, int e, const std::vector<int>& chosen) const {
    double sum = 0.0;
    for (const std::size_t c : of_view_[v]) {
      const Comparison& comparison = comparisons_[c];
      const std::size_t other = comparison.a == v ? comparison.b : comparison.a;
      if (chosen[other] < 0) continue;
      const auto own = static_cast<std::size_t>(e), theirs = static_cast<std::size_t>(chosen[other]);
      sum += comparison.evidence[comparison.a == v ? between_[own][theirs] : between_[theirs][own]];
    }
    return sum;
  }

  // Patches that a view shares with all others.
  [[nodiscard]] std::size_t shared(std::size_t v, const std::vector<int>& chosen) const {
    std::size_t sum = 0;
    for (const std::size_t c : of_view_[v]) {
      const Comparison& comparison = comparisons_[c];
      const auto first = static_cast<std::size_t>(chosen[comparison.a]);
      sum += comparison.compared[between_[first][static_cast<std::size_t>(chosen[comparison.b])]];
    }
    return sum;
  }

  [[nodiscard]] double total(const std::vector<int>& chosen) const {
    double sum = 0.0;
    for (std::size_t v = 0; v < views_; ++v) sum += 0.5 * cost(v, chosen[v], chosen);
    return sum;
  }

  // Best element, and how much the next one costs more.
  [[nodiscard]] std::pair<int, double> best(std::size_t v, const std::vector<int>& chosen) const {
    int first = 0;
    double least = std::numeric_limits<double>::infinity(), next = least;
    for (int e = 0; e < static_cast<int>(elements_); ++e) {
      const double here = cost(v, e, chosen);
      if (here < least) {
        next = least;
        least = here;
        first = e;
      } else {
        next = std::min(next, here);
      }
    }
    return {first, next - least};
  }

  // Changes one view at a time, those of `kept` never, as long as it helps.
  void improve(std::vector<int>& chosen, std::initializer_list<std::size_t> kept) const {
    for (std::size_t round = 0; round < 2 * views_; ++round) {
      bool changed = false;
      for (std::size_t v = 0; v < views_; ++v) {
        if (std::ranges::find(kept, v) != kept.end()) continue;
        const int now = best(v, chosen).first;
        if (cost(v, now, chosen) >= cost(v, chosen[v], chosen)) continue;
        chosen[v] = now;
        changed = true;
      }
      if (!changed) return;
    }
  }

  [[nodiscard]] std::vector<int> from_reference(std::size_t reference) const {
    std::vector<int> chosen(views_, -1);
    chosen[reference] = 0;
    for (std::size_t placed = 1; placed < views_; ++placed) {
      std::size_t clearest = views_;
      std::pair<int, double> choice{0, -1.0};
      for (std::size_t v = 0; v < views_; ++v) {
        if (chosen[v] >= 0) continue;
        const auto here = best(v, chosen);
        if (clearest < views_ && here.second <= choice.second) continue;
        clearest = v;
        choice = here;
      }
      chosen[clearest] = choice.first;
    }
    improve(chosen, {reference});
    return chosen;
  }

  // An element under which a view meets hardly any other is not confirmed by their having nothing to differ in.
  [[nodiscard]] bool is_decided(std::size_t v, std::size_t reference, const std::vector<int>& chosen) const {
    constexpr double kFewestShared = 0.5;  // of what it would share at another element
    const double at_best = total(chosen), own = cost(v, chosen[v], chosen);
    const auto met = static_cast<double>(shared(v, chosen));
    for (int e = 0; e < static_cast<int>(elements_); ++e) {
      if (e == chosen[v]) continue;
      std::vector<int> other = chosen;
      other[v] = e;
      improve(other, {v, reference});
      if (total(other) - at_best <= std::max(kDecisiveEvidence, own)) return false;
      if (met < kFewestShared * static_cast<double>(shared(v, other))) return false;
    }
    return true;
  }

 private:
  std::size_t views_, elements_;
  std::vector<std::vector<std::size_t>> between_;
  std::vector<Comparison> comparisons_;
  std::vector<std::vector<std::size_t>> of_view_;
};

std::vector<Comparison> pairs_of(std::size_t views, std::span<const Link> links) {
  std::vector<Comparison> pairs;
  if (static_cast<int>(views) > kAllPairsUpTo) {
    for (const Link& link : links) {
      pairs.push_back({static_cast<std::size_t>(link.first), static_cast<std::size_t>(link.second)});
    }
    return pairs;
  }
  for (std::size_t a = 0; a < views; ++a) {
    for (std::size_t b = a + 1; b < views; ++b) pairs.push_back({a, b});
  }
  return pairs;
}

}  // namespace

Result<SymmetryChoice> choose_elements(const ComparedViews& views, std::span<const Pose> poses,
                                       std::span<const Link> links, std::span<const Pose> elements,
                                       const Context& context) {
  const auto count = static_cast<std::size_t>(views.count());
  std::vector<Comparison> pairs = pairs_of(count, links);
  parallel_for(context, pairs.size(), 1, [&](std::size_t p) {
    Comparison& pair = pairs[p];
    for (const Pose& element : elements) {
      if (context.cancelled()) return;
      const int a = static_cast<int>(pair.a), b = static_cast<int>(pair.b);
      const Pose b_from_a = views.aligned(a, b, poses[pair.b].inverse(Eigen::Isometry) * element * poses[pair.a]);
      const ViewDifference difference = views.difference(a, b, b_from_a);
      pair.evidence.push_back(difference.evidence);
      pair.compared.push_back(difference.compared);
    }
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while a symmetric part's scans were compared");

  const Choice choice(count, elements.size(), quotients(elements), std::move(pairs));
  SymmetryChoice best{0, std::vector<int>(count, 0), std::vector<char>(count, 0)};
  std::vector<int> cheapest;
  for (std::size_t reference = 0; reference < count; ++reference) {
    std::vector<int> chosen = choice.from_reference(reference);
    if (cheapest.empty() || choice.total(chosen) < choice.total(cheapest)) cheapest = std::move(chosen);
  }
  // The reference that most others are decided against: it shows what breaks the symmetry.
  std::ptrdiff_t most = -1;
  for (std::size_t reference = 0; reference < count; ++reference) {
    std::vector<char> decided(count, 0);
    for (std::size_t v = 0; v < count; ++v) {
      decided[v] = v == reference || choice.is_decided(v, reference, cheapest) ? 1 : 0;
    }
    const auto how_many = std::ranges::count(decided, 1);
    if (how_many <= most) continue;
    most = how_many;
    best.reference = static_cast<int>(reference);
    best.decided = std::move(decided);
  }
  // Only relations between views count: the reference keeps its element.
  const Pose back =
      elements[static_cast<std::size_t>(cheapest[static_cast<std::size_t>(best.reference)])].inverse(Eigen::Isometry);
  for (std::size_t v = 0; v < count; ++v) {
    const Eigen::Matrix3d wanted = back.linear() * elements[static_cast<std::size_t>(cheapest[v])].linear();
    const auto off = [&](const Pose& element) { return (element.linear() - wanted).norm(); };
    best.element[v] = static_cast<int>(std::ranges::min_element(elements, {}, off) - elements.begin());
  }
  return best;
}

}  // namespace asbuilt::refine
