// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/view_difference.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

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
constexpr double kPoseErrorInSigmas = 1.0;     // what refinement and calibration may leave of a patch's mean
constexpr double kDiffers = 3.0, kMost = 8.0;  // in standard deviations; no single patch decides everything
constexpr std::size_t kFewestCompared = 30;
constexpr int kAlignmentSteps = 4;
constexpr double kTukeyTuning = 4.685;
constexpr double kFirmlyHeld = 0.01;  // information of a direction, of what every match holding it fully would give
constexpr double kTimesWithin = 4.0, kMoreThanWithin = 0.05;

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
  for (const View& view : views) points_.push_back(view.segment_in_scan.size());
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

std::size_t ComparedViews::points(int view) const { return points_[static_cast<std::size_t>(view)]; }

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
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information / weights);
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

using Table = std::vector<std::vector<ViewDifference>>;  // between groups, by place

// Puts group b into group a.
void merge(std::vector<std::vector<int>>& groups, Table& between, std::size_t a, std::size_t b) {
  groups[a].insert(groups[a].end(), groups[b].begin(), groups[b].end());
  groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(b));
  for (std::size_t g = 0; g < between.size(); ++g) {
    if (g == a || g == b) continue;
    between[a][g] += between[b][g];
    between[g][a] = between[a][g];
  }
  between.erase(between.begin() + static_cast<std::ptrdiff_t>(b));
  for (auto& row : between) row.erase(row.begin() + static_cast<std::ptrdiff_t>(b));
}

}  // namespace

Result<std::optional<Individuals>> two_individuals(const ComparedViews& views, std::span<const Pose> poses,
                                                   std::span<const Link> links, const Context& context) {
  if (views.count() < 4) return std::optional<Individuals>();
  std::vector<ViewDifference> found(links.size());
  parallel_for(context, links.size(), 1, [&](std::size_t l) {
    if (context.cancelled()) return;
    const auto a = static_cast<std::size_t>(links[l].first), b = static_cast<std::size_t>(links[l].second);
    found[l] = views.difference(links[l].first, links[l].second, poses[b].inverse(Eigen::Isometry) * poses[a]);
  });
  if (context.cancelled()) return fail(ErrorCode::cancelled, "cancelled while the scans were compared");

  const auto count = static_cast<std::size_t>(views.count());
  std::vector<std::vector<int>> groups(count);
  Table between(count, std::vector<ViewDifference>(count));
  ViewDifference all;
  for (std::size_t v = 0; v < count; ++v) groups[v] = {static_cast<int>(v)};
  for (std::size_t l = 0; l < links.size(); ++l) {
    const auto a = static_cast<std::size_t>(links[l].first), b = static_cast<std::size_t>(links[l].second);
    between[a][b] = between[b][a] = found[l];
    all += found[l];
  }
  while (groups.size() > 2) {
    std::size_t best_a = 0, best_b = 0;
    double least = 2.0;
    for (std::size_t a = 0; a < groups.size(); ++a) {
      for (std::size_t b = a + 1; b < groups.size(); ++b) {
        if (between[a][b].compared < kFewestCompared || between[a][b].share() >= least) continue;
        least = between[a][b].share();
        best_a = a;
        best_b = b;
      }
    }
    if (best_a == best_b) return std::optional<Individuals>();  // what is left shares too little
    merge(groups, between, best_a, best_b);
  }
  const ViewDifference& across = between[0][1];
  if (across.compared < kFewestCompared || groups[0].size() < 2 || groups[1].size() < 2) {
    return std::optional<Individuals>();
  }
  ViewDifference within = all;
  within.compared -= across.compared;
  within.differing -= across.differing;
  if (across.share() <= kTimesWithin * within.share() + kMoreThanWithin) return std::optional<Individuals>();
  for (auto& group : groups) std::ranges::sort(group);
  const bool swap = std::pair(groups[1].size(), -groups[1][0]) > std::pair(groups[0].size(), -groups[0][0]);
  Individuals individuals{groups[swap ? 1 : 0], groups[swap ? 0 : 1], across.share(), within.share(), 0.0};
  individuals.height_mm = across.height_mm / static_cast<double>(across.differing);
  return std::optional(std::move(individuals));
}

}  // namespace asbuilt::refine
