// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/view_difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/robust.h"
#include "asbuilt/refine/sampled_view.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kPoints = 10000, kProbes = 4000;
constexpr double kPatchRatio = 0.05, kReachRatio = 0.03;  // of the diameter
constexpr double kFacing = 0.7, kAsideInSpacings = 1.5;
constexpr double kProbesAcross = 4.0;  // of a patch, at least
constexpr int kFewestInPatch = 8;
constexpr double kPoseErrorInSigmas = 0.4;     // what refinement and calibration may leave of a patch's mean
constexpr double kDiffers = 3.0, kMost = 8.0;  // in standard deviations; no single patch decides everything
constexpr std::size_t kFewestCompared = 30;
constexpr int kAlignmentSteps = 4;
constexpr double kTukeyTuning = 4.685;
constexpr double kFirmlyHeld = 0.01;  // information of a direction, of what every match holding it fully would give
// Two individuals differ between each other so much more often than within. Groups are chosen so that they differ, and
// where few patches were compared within them, none that differs says little.
constexpr double kTimesWithin = 4.0, kMoreThanWithin = 0.01, kUnseenWithin = 2.0;
constexpr double kProof = 50.0;  // log-likelihood: several patches

double squared(double x) { return x * x; }

struct Patch {
  double sum = 0.0;
  int points = 0;
};

// One face of one cell: the cell's place and the axis that the surface faces most.
using PatchKey = std::array<int, 4>;

PatchKey key_of(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, double edge_mm) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const auto cell = [&](double x) { return static_cast<int>(std::floor(x / edge_mm)); };
  return {cell(point.x()), cell(point.y()), cell(point.z()), static_cast<int>(2 * axis + (normal[axis] < 0.0 ? 1 : 0))};
}

}  // namespace

ViewDifference& ViewDifference::operator+=(const ViewDifference& other) {
  compared += other.compared;
  differing += other.differing;
  evidence += other.evidence;
  height_mm += other.height_mm;
  return *this;
}

ComparedViews::ComparedViews(std::span<const View> views, double diameter_mm, const Context& context)
    : views_(views.size()), diameter_mm_(diameter_mm) {
  parallel_for(context, views.size(), 1, [&](std::size_t v) {
    views_[v] =
        sampled_view(views[v].segment_in_scan, views[v].noise_sigma_mm, {kPoints, kProbes, true, false}, context);
    // Rims and edges alone, not all that is near them: the mean over a patch bears a few mixed points, and on a
    // coarsely scanned part nearly everything is near.
    const std::vector<Place> places = places_of(views_[v].points, *views_[v].tree, views_[v].spacing_mm, context);
    for (std::size_t i = 0; i < places.size(); ++i) views_[v].weight[i] = places[i] == Place::inside ? 1.0F : 0.0F;
  });
}

ComparedViews::~ComparedViews() = default;

int ComparedViews::count() const { return static_cast<int>(views_.size()); }

template <class Use>
void ComparedViews::for_each_pair(const SampledView& from, const SampledView& to, const Pose& to_from_from,
                                  const Use& use) const {
  const auto reach = static_cast<float>(kReachRatio * diameter_mm_);
  const double aside = squared(kAsideInSpacings * to.spacing_mm);
  for (const std::uint32_t i : from.coarse) {
    if (from.weight[i] < 1.0F) continue;
    const Eigen::Vector3d point = to_from_from * from.points.positions[i].cast<double>();
    const Eigen::Vector3d normal = to_from_from.linear() * from.points.normals[i].cast<double>();
    const std::uint32_t q = to.tree
                                ->nearest_facing(point.cast<float>(), reach, to.points.normals, normal.cast<float>(),
                                                 static_cast<float>(kFacing))
                                .index;
    if (q == KdTree::kNone || to.weight[q] < 1.0F) continue;
    const Eigen::Vector3d offset = point - to.points.positions[q].cast<double>();
    const Eigen::Vector3d plane = to.points.normals[q].cast<double>();
    const double height = offset.dot(plane);
    if (offset.squaredNorm() - squared(height) <= aside) use(Pair{point, plane, height});
  }
}

ViewDifference ComparedViews::one_way(const SampledView& from, const SampledView& to, const Pose& to_from_from) const {
  std::map<PatchKey, Patch> patches;
  const double thinning = static_cast<double>(from.points.size()) / static_cast<double>(from.coarse.size());
  const double edge = std::max(kPatchRatio * diameter_mm_, kProbesAcross * from.spacing_mm * std::sqrt(thinning));
  for_each_pair(from, to, to_from_from, [&](const Pair& pair) {
    Patch& patch = patches[key_of(pair.point, pair.normal, edge)];
    patch.sum += pair.height_mm;
    ++patch.points;
  });
  // A plane fitted to noisy neighbours is no more exact than a share of the spacing on a curved surface.
  const double sigma = std::max(std::hypot(from.noise_sigma_mm, to.noise_sigma_mm), 0.05 * to.spacing_mm);
  ViewDifference difference;
  for (const auto& [key, patch] : patches) {
    if (patch.points < kFewestInPatch) continue;
    ++difference.compared;
    const double mean = std::abs(patch.sum / patch.points);
    const double z = mean / (sigma * std::sqrt(1.0 / patch.points + squared(kPoseErrorInSigmas)));
    if (z <= kDiffers) continue;
    ++difference.differing;
    difference.height_mm += mean;
    difference.evidence += 0.5 * (squared(std::min(z, kMost)) - squared(kDiffers));
  }
  return difference;
}

ViewDifference ComparedViews::difference(int a, int b, const Pose& b_from_a) const {
  const SampledView& first = views_[static_cast<std::size_t>(a)];
  const SampledView& second = views_[static_cast<std::size_t>(b)];
  ViewDifference both = one_way(first, second, b_from_a);
  both += one_way(second, first, b_from_a.inverse(Eigen::Isometry));
  return both;
}

Pose ComparedViews::aligned(int a, int b, const Pose& b_from_a) const {
  const SampledView& first = views_[static_cast<std::size_t>(a)];
  const SampledView& second = views_[static_cast<std::size_t>(b)];
  Pose pose = b_from_a;
  for (int step = 0; step < kAlignmentSteps; ++step) {
    std::vector<Pair> pairs;
    for_each_pair(first, second, pose, [&](const Pair& pair) { pairs.push_back(pair); });
    if (pairs.size() < kFewestCompared) return pose;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    std::vector<double> heights;
    for (const Pair& pair : pairs) {
      centre += pair.point / static_cast<double>(pairs.size());
      heights.push_back(std::abs(pair.height_mm));
    }
    double squares = 0.0;
    for (const Pair& pair : pairs) squares += (pair.point - centre).squaredNorm();
    const double radius = std::max(std::sqrt(squares / static_cast<double>(pairs.size())), 1e-9 * diameter_mm_);
    const TukeyLoss loss{kTukeyTuning * std::max(1.4826 * median_of(std::move(heights)), 1e-7 * diameter_mm_)};
    Matrix6d information = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    double weights = 0.0;
    for (const Pair& pair : pairs) {
      const double weight = loss.weight(squared(pair.height_mm));
      Vector6d jacobian;
      jacobian << (pair.point - centre).cross(pair.normal) / radius, pair.normal;
      information += weight * jacobian * jacobian.transpose();
      gradient += weight * pair.height_mm * jacobian;
      weights += weight;
    }
    if (!(weights > 0.0)) return pose;
    const SymmetricEigen<6> eigen(information / weights);
    Vector6d twist = Vector6d::Zero();
    for (int i = 0; i < 6; ++i) {
      if (eigen.eigenvalues()[i] < kFirmlyHeld) continue;
      twist -=
          eigen.eigenvectors().col(i).dot(gradient / weights) / eigen.eigenvalues()[i] * eigen.eigenvectors().col(i);
    }
    const Eigen::Matrix3d rotation = rotation_from_axis_angle(twist.head<3>() / radius);
    pose.linear() = rotation * pose.linear();
    pose.translation() = rotation * (pose.translation() - centre) + centre + twist.tail<3>();
    pose = orthonormalised(pose);
  }
  return pose;
}

namespace {

using Table = std::vector<std::vector<ViewDifference>>;  // between views, by place
using Sides = std::vector<char>;                         // 0 or 1, one a view

constexpr double kUsualShare = 0.05;  // of the patches of two individuals that differ

ViewDifference across(const Table& between, const Sides& sides, bool same) {
  ViewDifference sum;
  for (std::size_t a = 0; a < sides.size(); ++a) {
    for (std::size_t b = a + 1; b < sides.size(); ++b) {
      if ((sides[a] == sides[b]) == same) sum += between[a][b];
    }
  }
  return sum;
}

// How much more likely two views show two individuals than one, if patches of two differ in `share` of the cases.
double apart(const ViewDifference& pair, double share) {
  return pair.evidence - share * static_cast<double>(pair.compared - pair.differing);
}

// By how much it speaks against the side of a view that it shows the same as the others there.
double gain_of_moving(std::size_t view, const Table& between, const Sides& sides, double share) {
  double gain = 0.0;
  for (std::size_t other = 0; other < sides.size(); ++other) {
    if (other == view) continue;
    gain += (sides[other] == sides[view] ? 1.0 : -1.0) * apart(between[view][other], share);
  }
  return gain;
}

double score(const Table& between, const Sides& sides, double share) {
  double sum = 0.0;
  for (std::size_t a = 0; a < sides.size(); ++a) {
    for (std::size_t b = a + 1; b < sides.size(); ++b) {
      if (sides[a] != sides[b]) sum += apart(between[a][b], share);
    }
  }
  return sum;
}

// Moves views, but for those `kept`, one by one or two at a time, for as long as that makes the sides more likely. Two
// views that differ change places together: alone, each would lie beside the other.
void improve(const Table& between, Sides& sides, double share, std::span<const std::size_t> kept = {}) {
  constexpr double kLeast = 1e-9;
  const std::size_t count = sides.size();
  const auto is_kept = [&](std::size_t view) { return std::ranges::find(kept, view) != kept.end(); };
  std::vector<double> gains(count);
  for (std::size_t moves = 0; moves < 10 * count; ++moves) {
    for (std::size_t view = 0; view < count; ++view) gains[view] = gain_of_moving(view, between, sides, share);
    std::size_t best = 0, with = 0;
    double most = kLeast;
    for (std::size_t a = 0; a < count; ++a) {
      if (is_kept(a)) continue;
      if (gains[a] > most) {
        most = gains[a];
        best = with = a;
      }
      for (std::size_t b = a + 1; b < count; ++b) {
        if (sides[a] == sides[b] || between[a][b].differing == 0 || is_kept(b)) continue;
        const double both = gains[a] + gains[b] + 2.0 * apart(between[a][b], share);
        if (both <= most) continue;
        most = both;
        best = a;
        with = b;
      }
    }
    if (most == kLeast) return;
    sides[best] = static_cast<char>(1 - sides[best]);
    if (with != best) sides[with] = static_cast<char>(1 - sides[with]);
  }
}

// The others follow the two views `a` and `b`, the clearest first.
Sides around(std::size_t a, std::size_t b, const Table& between, double share) {
  constexpr char kOpen = 2;
  Sides sides(between.size(), kOpen);
  sides[a] = 0;
  sides[b] = 1;
  for (std::size_t placed = 2; placed < sides.size(); ++placed) {
    std::size_t clearest = 0;
    double most = -1.0, for_second = 0.0;
    for (std::size_t view = 0; view < sides.size(); ++view) {
      if (sides[view] != kOpen) continue;
      double lead = 0.0;
      for (std::size_t other = 0; other < sides.size(); ++other) {
        if (sides[other] == kOpen) continue;
        lead += (sides[other] == 0 ? 1.0 : -1.0) * apart(between[view][other], share);
      }
      if (std::abs(lead) <= most) continue;
      most = std::abs(lead);
      clearest = view;
      for_second = lead;
    }
    sides[clearest] = for_second > 0.0 ? 1 : 0;
  }
  return sides;
}

// Views of which it is known on which side they are, that of the view that differs most from others being given: views
// that meet the rest only where both individuals are alike may be on either.
std::vector<char> decided(const Table& between, const Sides& sides) {
  std::vector<double> evidence(sides.size(), 0.0);
  for (std::size_t a = 0; a < sides.size(); ++a) {
    for (std::size_t b = 0; b < sides.size(); ++b) evidence[a] += between[a][b].evidence;
  }
  const auto reference = static_cast<std::size_t>(std::ranges::max_element(evidence) - evidence.begin());
  const double most = score(between, sides, kUsualShare);
  std::vector<char> known(sides.size(), 1);
  for (std::size_t view = 0; view < sides.size(); ++view) {
    if (view == reference) continue;
    Sides other = sides;
    other[view] = static_cast<char>(1 - other[view]);
    const std::array<std::size_t, 2> kept = {reference, view};
    improve(between, other, kUsualShare, kept);
    known[view] = most - score(between, other, kUsualShare) >= kDecisiveEvidence ? 1 : 0;
  }
  return known;
}

// The likeliest two sides: grown from each of the pairs that differ most, then changed view by view. How often patches
// of two individuals differ is learnt on the way.
Sides likeliest_sides(const Table& between) {
  constexpr std::size_t kMostStarts = 12;
  constexpr int kRounds = 3;
  constexpr double kLeastShare = 0.005;
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < between.size(); ++a) {
    for (std::size_t b = a + 1; b < between.size(); ++b) pairs.emplace_back(a, b);
  }
  std::ranges::stable_sort(pairs, std::ranges::greater{},
                           [&](const auto& pair) { return between[pair.first][pair.second].evidence; });
  Sides best(between.size(), 0);
  double most = 0.0;
  for (std::size_t start = 0; start < std::min(kMostStarts, pairs.size()); ++start) {
    double share = kUsualShare;
    Sides sides = around(pairs[start].first, pairs[start].second, between, share);
    for (int round = 0; round < kRounds; ++round) {
      improve(between, sides, share);
      share = std::max(kLeastShare, across(between, sides, false).share());
    }
    const double found = score(between, sides, kUsualShare);
    if (found <= most) continue;
    most = found;
    best = sides;
  }
  return best;
}

}  // namespace

Result<std::optional<Individuals>> two_individuals(const ComparedViews& views, std::span<const Pose> poses,
                                                   std::span<const Link> links, const Context& context) {
  if (views.count() < 4) return std::optional<Individuals>();
  std::vector<ViewDifference> found(links.size());
  parallel_for(context, links.size(), 1, [&](std::size_t l) {
    if (context.cancelled()) return;
    const auto a = static_cast<std::size_t>(links[l].first), b = static_cast<std::size_t>(links[l].second);
    // Two individuals blended by a refinement are nowhere where they belong; only a pair fitted to one another shows
    // what differs in shape.
    const Pose b_from_a = views.aligned(links[l].first, links[l].second, poses[b].inverse(Eigen::Isometry) * poses[a]);
    found[l] = views.difference(links[l].first, links[l].second, b_from_a);
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while the scans were compared");

  const auto count = static_cast<std::size_t>(views.count());
  Table between(count, std::vector<ViewDifference>(count));
  for (std::size_t l = 0; l < links.size(); ++l) {
    const auto a = static_cast<std::size_t>(links[l].first), b = static_cast<std::size_t>(links[l].second);
    between[a][b] = between[b][a] = found[l];
  }
  const Sides sides = likeliest_sides(between);
  std::array<std::vector<int>, 2> groups;
  std::vector<int> undecided;
  const std::vector<char> known = decided(between, sides);
  for (std::size_t v = 0; v < count; ++v) {
    (known[v] != 0 ? groups[static_cast<std::size_t>(sides[v])] : undecided).push_back(static_cast<int>(v));
  }
  if (groups[0].size() < 2 || groups[1].size() < 2) return std::optional<Individuals>();
  const ViewDifference differences = across(between, sides, false), within = across(between, sides, true);
  const double often_within =
      (static_cast<double>(within.differing) + kUnseenWithin) / std::max(1.0, static_cast<double>(within.compared));
  if (differences.compared < kFewestCompared || differences.evidence < kProof ||
      differences.share() <= kTimesWithin * often_within + kMoreThanWithin) {
    return std::optional<Individuals>();
  }
  if (groups[1].size() > groups[0].size() || (groups[1].size() == groups[0].size() && groups[1][0] < groups[0][0])) {
    std::swap(groups[0], groups[1]);
  }
  Individuals individuals{groups[0], groups[1], undecided, differences.share(), within.share(), 0.0};
  individuals.height_mm = differences.height_mm / static_cast<double>(differences.differing);
  return std::optional(std::move(individuals));
}

}  // namespace asbuilt::refine
