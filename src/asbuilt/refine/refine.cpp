// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/refine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>
#include <utility>

#include "asbuilt/core/disjoint_sets.h"
#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/refine/cell_gradients.h"
#include "asbuilt/refine/correspondences.h"
#include "asbuilt/refine/normal_equations.h"
#include "asbuilt/refine/sampled_view.h"

namespace asbuilt::refine {
namespace {

constexpr double kTukeyTuning = 4.685;    // 95 % efficiency on normal residuals
constexpr int kCoarsePoints = 2500;       // a view's points in the first steps, which only have to come near
constexpr double kReachDecay = 0.7;       // an edge's reach never shrinks faster, lest a late view be left behind
constexpr double kReachInScales = 8.0;    // and does not go below this many robust scales ...
constexpr double kReachInSpacings = 2.5;  // ... or spacings of the target
constexpr double kMaxScaleRatio = 3.0;    // one bad edge may not widen its own loss beyond this share of the others'
constexpr double kMinWeight = 1e-3;       // of an edge whose residuals are wide, relative to a usual one
constexpr double kCoarseMotion = 0.5;     // in units of noise: near enough for the full sample
constexpr double kHeldInSpreads = 1.0;    // squared spreads of the normals that an edge must hold more than
constexpr double kMinHeld = 1e-7, kMaxHeld = 5e-3;  // bounds of the rank threshold of an edge
constexpr double kHeldByFaces = 0.01;               // where ends of faces have no say
constexpr double kAlikeInRadii = 0.4;               // of a view: so far apart, errors of matches have little in common
constexpr double kOverclaimed = 3.0;                // squared errors of links / their squared claims
constexpr double kFirmInScales = 1.0;               // standard deviation of a view, in units of noise
constexpr int kStepsAtFullReach = 2;                // with the CAD
constexpr double kRimBias = 0.02;                   // of the noise, as large as the mean of 2500 matches errs anyway
constexpr double kRimsClipped = 3.0;                // scales: outliers say nothing of a bias
constexpr std::size_t kEnoughOfRims = 1000;         // matches, to see a bias of that size
constexpr double kKeepSpacings = 0.05;              // a motion by which hardly a point changes its nearest neighbour

double squared(double x) { return x * x; }

Result<void> check_view(const View& view, std::size_t index) {
  const PointCloud& cloud = view.segment_in_scan;
  if (cloud.empty()) return fail(ErrorCode::invalid_argument, fmt::format("view {} has no points", index));
  if (cloud.normals.size() != cloud.size()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("view {} has {} normals for {} points", index, cloud.normals.size(), cloud.size()));
  }
  if (!is_rigid(view.model_from_scan.matrix())) {
    return fail(ErrorCode::invalid_argument, fmt::format("the pose of view {} is not a rigid motion", index));
  }
  if (!(view.noise_sigma_mm >= 0.0 && std::isfinite(view.noise_sigma_mm))) {
    return fail(ErrorCode::invalid_argument, fmt::format("noise of view {} is {} mm", index, view.noise_sigma_mm));
  }
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.positions[i].allFinite() && cloud.normals[i].allFinite()) continue;
    return fail(ErrorCode::invalid_argument, fmt::format("view {}: point {} is not finite", index, i));
  }
  return {};
}

// Links with first < second, in the order of the input, each once. The graph must hold together.
Result<std::vector<Link>> check_links(std::span<const Link> links, int views) {
  std::vector<Link> unique;
  std::set<std::pair<int, int>> known;
  DisjointSets linked(views);
  for (const Link& link : links) {
    const bool exists = link.first >= 0 && link.second >= 0 && link.first < views && link.second < views;
    if (!exists || link.first == link.second) {
      return fail(ErrorCode::invalid_argument,
                  fmt::format("link {} - {} among {} views is impossible", link.first, link.second, views));
    }
    const auto [low, high] = std::minmax(link.first, link.second);
    if (known.emplace(low, high).second) unique.push_back({low, high});
    linked.unite(link.first, link.second);
  }
  if (linked.count() > 1) {
    return fail(
        ErrorCode::not_possible,
        fmt::format("the links leave {} views in {} pieces, a joint refinement needs one", views, linked.count()));
  }
  return unique;
}

int view_with_most_points(std::span<const View> views) {
  const auto most = std::ranges::max_element(
      views, {}, [](const View& view) { return view.segment_in_scan.size(); });  // the first of equals
  return static_cast<int>(most - views.begin());
}

SamplingRules sampling_rules(const RefineOptions& options) {
  return {static_cast<std::size_t>(options.points_per_scan), kCoarsePoints, options.face_normals, options.rim_weights};
}

bool has_sample(const View& view, const SamplingRules& rules) {
  return view.sample && view.sample->rules == rules && view.sample->noise_sigma_mm == view.noise_sigma_mm;
}

// A covariance (its eigenvectors, and variances, ascending) that is nowhere less than `least`, by its first `held`
// directions; the others stay.
Matrix6d widened(const Matrix6d& motions, const Vector6d& variances, Eigen::Index held, const Matrix6d& least) {
  const Matrix6d own = motions * variances.asDiagonal() * motions.transpose();
  if (held == 0 || !(variances.head(held).minCoeff() > 0.0)) return own;
  const Eigen::MatrixXd unit = motions.leftCols(held) * variances.head(held).cwiseSqrt().cwiseInverse().asDiagonal();
  const SymmetricEigen<Eigen::Dynamic> ratios(unit.transpose() * least * unit);
  const Eigen::MatrixXd wide =
      motions.leftCols(held) * variances.head(held).cwiseSqrt().asDiagonal() * ratios.eigenvectors();
  const Eigen::VectorXd more = (ratios.eigenvalues().array() - 1.0).cwiseMax(0.0);
  return own + wide * more.asDiagonal() * wide.transpose();
}

// The refinement of one component; the functions below are its steps in the order in which they happen.
class JointRefinement {
 public:
  JointRefinement(std::span<const View> views, std::vector<Link> links, const RefineOptions& options,
                  std::span<const ModelFit> on_model, const Context& context)
      : options_(options), context_(context), links_(std::move(links)), fixed_(view_with_most_points(views)) {
    sample(views);
    for (const View& view : views) poses_.push_back(view.model_from_scan);
    if (!on_model.empty()) start_on_model(on_model);
    measure();
    make_model_holds(on_model);
    make_edges(views);
  }

  Result<Refinement> run() {
    Refinement result;
    result.fixed_view = fixed_;
    result.on_model = !model_holds_.empty();
    if (!edges_.empty()) ASBUILT_CHECK(descend(result));
    if (!edges_.empty()) ASBUILT_CHECK(conclude(result));
    result.converged = edges_.empty() || result.converged;
    if (result.covariance.empty()) result.covariance.assign(poses_.size(), Matrix6d::Zero());
    result.model_from_scan = poses_;
    if (!edges_.empty()) result.handed_on.resize(poses_.size());
    for (const DirectedEdge& edge : edges_) {
      double& reach = result.handed_on[static_cast<std::size_t>(edge.source)].reach_mm;
      reach = std::max(reach, edge.reach_mm);
    }
    return result;
  }

 private:
  enum class Outcome { improved, settled };

  struct ModelHold {
    Matrix6d information;  // of scaled twists
    Pose model_from_scan;
  };

  void sample(std::span<const View> views) {
    const SamplingRules rules = sampling_rules(options_);
    views_.resize(views.size());
    parallel_for(context_, views.size(), 1, [&](std::size_t v) {
      const View& view = views[v];
      views_[v] = has_sample(view, rules) ? *view.sample
                                          : sampled_view(view.segment_in_scan, view.noise_sigma_mm, rules, context_);
      if (options_.rim_matches) find_rims(views_[v], view.segment_in_scan, view.beside_occluder, context_);
    });
  }

  // Origin and length that make rotations and translations comparable, and the diameter of all views together.
  void measure() {
    Eigen::AlignedBox3d box;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (std::size_t v = 0; v < views_.size(); ++v) {
      centre += poses_[v] * views_[v].centroid;
      for (const Eigen::Vector3f& point : views_[v].points.positions) box.extend(poses_[v] * point.cast<double>());
    }
    scaling_.origin = centre / static_cast<double>(views_.size());
    diameter_ = box.diagonal().norm();
    double squares = 0.0;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      squares += squared(views_[v].radius_mm) + (poses_[v] * views_[v].centroid - scaling_.origin).squaredNorm();
    }
    scaling_.length_mm = std::sqrt(squares / static_cast<double>(views_.size()));
    if (!(scaling_.length_mm > 0.0)) scaling_.length_mm = 1.0;
  }

  void make_edges(std::span<const View> views) {
    const bool starts_near = options_.anneal && model_holds_.empty() &&
                             std::ranges::all_of(views, [](const View& view) { return view.earlier.reach_mm > 0.0; });
    const auto reach_of = [&](int v) { return views[static_cast<std::size_t>(v)].earlier.reach_mm; };
    for (const Link& link : links_) {
      for (const auto& [from, to] : {std::pair(link.first, link.second), std::pair(link.second, link.first)}) {
        DirectedEdge edge;
        edge.source = from;
        edge.target = to;
        edge.reach_mm = start_reach();
        if (starts_near) edge.reach_mm = std::min(edge.reach_mm, std::max(reach_of(from), reach_of(to)));
        edges_.push_back(edge);
        edge.of_rims = true;
        if (options_.rim_matches) rim_edges_.push_back(edge);
      }
    }
  }

  // As the fits lie to one another; the fixed view stays where it was.
  void start_on_model(std::span<const ModelFit> on_model) {
    const auto fixed = static_cast<std::size_t>(fixed_);
    model_motion_ = poses_[fixed] * on_model[fixed].model_from_scan.inverse(Eigen::Isometry);
    for (std::size_t v = 0; v < poses_.size(); ++v) {
      if (v != fixed) poses_[v] = orthonormalised(model_motion_ * on_model[v].model_from_scan);
    }
  }

  // What the CAD says of each view.
  void make_model_holds(std::span<const ModelFit> on_model) {
    const Matrix6d twist_from_scaled = scaling_.twist_from_scaled();
    for (const ModelFit& fit : on_model) {
      const Matrix6d information = twist_from_scaled.transpose() * fit.information * twist_from_scaled;
      model_holds_.push_back({0.5 * (information + information.transpose()), fit.model_from_scan});
    }
  }

  // Like links to one more view, the CAD, which moves with the rest: it says where views are against one another.
  // Errors of matches are not independent, so that a link claims to know more than it does (kOverclaimed);
  // `emphasis` sets that right.
  [[nodiscard]] std::vector<LinkBlock> model_blocks(double emphasis) const {
    std::vector<LinkBlock> blocks;
    for (std::size_t v = 0; v < model_holds_.size(); ++v) {
      const ModelHold& hold = model_holds_[v];
      const Pose off = poses_[v] * (model_motion_ * hold.model_from_scan).inverse(Eigen::Isometry);
      const Eigen::AngleAxisd turn(off.linear());
      Vector6d twist;
      twist << scaling_.length_mm * turn.angle() * turn.axis(), off * scaling_.origin - scaling_.origin;
      LinkBlock block;
      block.first = static_cast<int>(v);
      block.second = static_cast<int>(views_.size());
      block.information = emphasis * squared(usual_scale_) * hold.information;
      block.gradient = block.information * twist;
      blocks.push_back(block);
    }
    return blocks;
  }

  [[nodiscard]] double start_reach() const { return options_.start_distance_ratio * diameter_; }

  [[nodiscard]] const SampledView& target(const DirectedEdge& edge) const {
    return views_[static_cast<std::size_t>(edge.target)];
  }

  [[nodiscard]] double noise_of(const DirectedEdge& edge) const {
    return std::hypot(views_[static_cast<std::size_t>(edge.source)].noise_sigma_mm, target(edge).noise_sigma_mm);
  }

  // Below this a residual is as good as zero, whatever its median says.
  [[nodiscard]] double scale_floor(const DirectedEdge& edge) const {
    return std::max({0.5 * noise_of(edge), 0.01 * target(edge).spacing_mm, 1e-7 * diameter_});
  }

  [[nodiscard]] MatchRules rules(bool coarse) const {
    const double degrees = std::numbers::pi / 180.0;
    return {coarse, !options_.paper_mode, std::cos(options_.max_normal_angle_deg * degrees), options_.reach_weights,
            0.0};
  }

  // Edges keep the matches that they have where hardly one of them would change, unless all shall be searched `afresh`.
  [[nodiscard]] MatchRules matching_rules(bool coarse, bool afresh) const {
    MatchRules matching = rules(coarse);
    if (options_.keep_matches && !afresh) matching.keep_spacings = kKeepSpacings;
    return matching;
  }

  // Gives the number of edges whose matches are new.
  std::size_t match_and_scale(bool coarse, bool first, bool afresh) {
    const std::size_t searched = find_matches(edges_, views_, poses_, matching_rules(coarse, afresh), context_);
    if (!options_.anneal && !first) return searched;  // the published loss has one fixed scale
    std::vector<ResidualStatistics> statistics(edges_.size());
    parallel_for(context_, edges_.size(), 1,
                 [&](std::size_t e) { statistics[e] = residual_statistics(edges_[e], views_, poses_); });
    std::vector<double> scales;
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (!edges_[e].matches.empty()) scales.push_back(std::max(statistics[e].scale_mm, scale_floor(edges_[e])));
    }
    usual_scale_ = scales.empty() ? 0.0 : median_of(std::move(scales));
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const double own = std::max(statistics[e].scale_mm, scale_floor(edges_[e]));
      const double scale = options_.anneal ? std::min(own, kMaxScaleRatio * usual_scale_) : usual_scale_;
      edges_[e].spread_mm = scale;
      edges_[e].scale_mm = kTukeyTuning * scale;
      // Fits to the CAD agree on most faces from the start; what the others say must not pass for outliers.
      if (!model_holds_.empty()) edges_[e].scale_mm = std::max(edges_[e].scale_mm, to_go(edges_[e]));
      edges_[e].normal_spread = statistics[e].normal_spread;
      // Each edge counts by its own variance: precise scanners lead, and a view that stands wrong cannot bend the rest.
      const double ratio = squared(usual_scale_ / own);
      edges_[e].weight = options_.edge_weights ? std::clamp(ratio, kMinWeight, 1.0 / kMinWeight) : 1.0;
    }
    return searched;
  }

  // Rims count little until the views have settled; then it shows whether planes beside them stand off in the mean, as
  // where the sensor mixed the part with what is behind it or normals lean. As a bias does not average out, they
  // count by it against the noise of a mean. Gives whether anything has changed.
  bool weigh_rims_by_bias() {
    if (!options_.rim_weights || std::exchange(rims_weighed_, true)) return false;
    std::vector<RimResiduals> residuals(edges_.size());
    parallel_for(context_, edges_.size(), 1, [&](std::size_t e) {
      residuals[e] = rim_residuals(edges_[e], views_, poses_, kRimsClipped * usual_scale_);
    });
    RimResiduals sums;
    for (const RimResiduals& edge : residuals) {
      sums.beside_mm += edge.beside_mm;
      sums.inside_mm += edge.inside_mm;
      sums.beside += edge.beside;
      sums.inside += edge.inside;
    }
    if (std::min(sums.beside, sums.inside) < kEnoughOfRims || !(usual_scale_ > 0.0)) return false;
    const double bias_mm =
        sums.beside_mm / static_cast<double>(sums.beside) - sums.inside_mm / static_cast<double>(sums.inside);
    const auto weight = static_cast<float>(1.0 / (1.0 + squared(bias_mm / (kRimBias * usual_scale_))));
    bool changed = false;
    for (SampledView& view : views_) {
      for (std::size_t i = 0; i < view.near_rim.size(); ++i) {
        if (view.near_rim[i] == 0 || weight <= view.weight[i]) continue;
        view.weight[i] = weight;
        changed = true;
      }
    }
    return changed;
  }

  // How far the reach has to shrink yet.
  [[nodiscard]] double to_go(const DirectedEdge& edge) const {
    return edge.reach_mm - kReachInSpacings * target(edge).spacing_mm;
  }

  // Weight and scale are those of the edge's other matches. A scale of its own would be wider, as a face ends anywhere
  // within a spacing, and would believe rims that are no ends of faces.
  void match_rims(bool coarse, bool afresh) {
    for (std::size_t e = 0; e < rim_edges_.size(); ++e) {
      rim_edges_[e].reach_mm = edges_[e].reach_mm;
      // While the reach shrinks, nothing else may hold the views where these matches lead them.
      rim_edges_[e].scale_mm = std::max(edges_[e].scale_mm, to_go(edges_[e]));
      rim_edges_[e].weight = edges_[e].weight;
    }
    find_rim_matches(rim_edges_, views_, poses_, matching_rules(coarse, afresh), context_);
  }

  [[nodiscard]] std::vector<EdgeSums> linearised(std::span<const DirectedEdge> edges) const {
    return linearise(edges, views_, poses_, scaling_, options_.symmetric, context_);
  }

  [[nodiscard]] double cost_at(std::span<const Pose> poses) const {
    return total_cost(edges_, views_, poses, options_.symmetric, context_);
  }

  [[nodiscard]] double wanted_reach(const DirectedEdge& edge) const {
    return std::max(kReachInSpacings * target(edge).spacing_mm, kReachInScales * edge.spread_mm);
  }

  // From the misalignment to the noise: the reach follows the residuals down, edge by edge.
  void shrink_reach() {
    if (!options_.anneal) return;
    for (DirectedEdge& edge : edges_) {
      edge.reach_mm = std::min(edge.reach_mm, std::max(wanted_reach(edge), kReachDecay * edge.reach_mm));
    }
  }

  [[nodiscard]] bool reach_is_settled() const {
    return !options_.anneal || std::ranges::all_of(edges_, [&](const DirectedEdge& edge) {
      return edge.reach_mm <= 1.2 * wanted_reach(edge);
    });
  }

  // Variance of a residual of weight one: the weights of the edges are in the normal matrix and so do not belong here.
  [[nodiscard]] double unit_variance(std::span<const EdgeSums> sums) const {
    double squares = 0.0, count = 0.0;
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      squares += sums[e].weighted_squares;
      count += sums[e].weight / edges_[e].weight;
    }
    return count > 0.0 ? squares / count : 0.0;
  }

  // Root mean squared residual of all matches, each as its robust loss weights it, every edge alike.
  [[nodiscard]] double pooled_rms(std::span<const EdgeSums> sums) const {
    double squares = 0.0, count = 0.0;
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      squares += sums[e].weighted_squares / edges_[e].weight;
      count += sums[e].weight / edges_[e].weight;
    }
    return count > 0.0 ? std::sqrt(squares / count) : 0.0;
  }

  [[nodiscard]] EdgeSums both_ways(std::size_t link, std::span<const EdgeSums> sums) const {
    EdgeSums both = sums[2 * link];
    both += sums[2 * link + 1];
    return both;
  }

  // Information of a link below this is not believed. Where there is better, ends of faces and the CAD, not even what
  // may be more than feigned.
  [[nodiscard]] double held_threshold(std::size_t link) const {
    return model_holds_.empty() ? feigned_below(link) : std::max(kHeldByFaces, feigned_below(link));
  }

  // Information of a link below this is what the noise of normals feigns.
  [[nodiscard]] double feigned_below(std::size_t link) const {
    const double spread = std::max(edges_[2 * link].normal_spread, edges_[2 * link + 1].normal_spread);
    return std::clamp(kHeldInSpreads * squared(spread), kMinHeld, kMaxHeld);
  }

  // What ends of faces say of each link. Where its faces hold, they know better: an end is told to a fraction of a
  // spacing only.
  [[nodiscard]] std::vector<LinkBlock> rim_blocks(std::span<const EdgeSums> sums,
                                                  std::span<const EdgeSums> rim_sums) const {
    std::vector<LinkBlock> blocks;
    if (rim_sums.empty()) return blocks;
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const LinkBlock ends{links_[l].first, links_[l].second, both_ways(l, rim_sums).information,
                           rim_sums[2 * l].gradient - rim_sums[2 * l + 1].gradient, 0.0};
      blocks.push_back(part_not_held_by(both_ways(l, sums), ends, scaling_, kHeldByFaces));
    }
    return blocks;
  }

  [[nodiscard]] NormalEquations normal_equations(std::span<const EdgeSums> sums, std::span<const LinkBlock> rim_blocks,
                                                 std::span<const LinkBlock> model_blocks) const {
    std::vector<LinkBlock> blocks;
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const EdgeSums both = both_ways(l, sums);
      const LinkBlock block{links_[l].first, links_[l].second, both.information,
                            sums[2 * l].gradient - sums[2 * l + 1].gradient, both.weight};
      blocks.push_back(options_.drop_unheld ? held_part(block, both, scaling_, held_threshold(l)) : block);
      if (rim_blocks.empty()) continue;
      blocks.back().information += rim_blocks[l].information;
      blocks.back().gradient += rim_blocks[l].gradient;
    }
    blocks.insert(blocks.end(), model_blocks.begin(), model_blocks.end());
    const std::size_t nodes = views_.size() + (model_blocks.empty() ? 0 : 1);
    return {static_cast<int>(nodes), fixed_, blocks};
  }

  [[nodiscard]] Pose moved(const Pose& pose, const Vector6d& scaled_twist) const {
    // Rotate about the origin of the scaling: with large coordinates, x -> R x + t about zero would lose digits.
    const Eigen::Matrix3d rotation = rotation_from_axis_angle(scaled_twist.head<3>() / scaling_.length_mm);
    Pose result = pose;
    result.linear() = rotation * pose.linear();
    result.translation() = rotation * (pose.translation() - scaling_.origin) + scaling_.origin + scaled_twist.tail<3>();
    return orthonormalised(result);
  }

  [[nodiscard]] std::vector<Pose> moved(std::span<const Vector6d> scaled_step) const {
    std::vector<Pose> result = poses_;
    for (std::size_t v = 0; v < poses_.size(); ++v) {
      if (static_cast<int>(v) != fixed_) result[v] = moved(poses_[v], scaled_step[v]);  // exactly where it was
    }
    return result;
  }

  // Root mean squared motion (an upper bound) of the points of the view that moves most.
  [[nodiscard]] double largest_motion(std::span<const Vector6d> scaled_step) const {
    double largest = 0.0;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const Eigen::Vector3d w = scaled_step[v].head<3>() / scaling_.length_mm;
      const Eigen::Vector3d at_centre =
          w.cross(poses_[v] * views_[v].centroid - scaling_.origin) + scaled_step[v].tail<3>();
      largest = std::max(largest, std::hypot(at_centre.norm(), w.norm() * views_[v].radius_mm));
    }
    return largest;
  }

  // How a step changes the cost of what `blocks` say, to second order. Of the residuals of rims only a part has a say;
  // the whole of them would turn down steps that faces ask for.
  [[nodiscard]] static double modelled_change(std::span<const LinkBlock> blocks,
                                              std::span<const Vector6d> scaled_step) {
    double change = 0.0;
    for (const LinkBlock& block : blocks) {
      const Vector6d relative =
          scaled_step[static_cast<std::size_t>(block.first)] - scaled_step[static_cast<std::size_t>(block.second)];
      change += relative.dot(2.0 * block.gradient + block.information * relative);
    }
    return change;
  }

  // One Levenberg-Marquardt step for the current matches; `motion` is what it moved.
  Outcome take_step(const NormalEquations& equations, std::span<const LinkBlock> rim_blocks,
                    std::span<const LinkBlock> model_blocks, double cost, double& motion) {
    motion = 0.0;
    for (int attempt = 0; attempt < 8; ++attempt) {
      const std::vector<Vector6d> step = equations.step(damping_, options_.paper_mode);
      if (!step.empty()) {
        const std::vector<Pose> candidate = moved(step);
        const double modelled = modelled_change(rim_blocks, step) + modelled_change(model_blocks, step);
        if (cost_at(candidate) + modelled < cost) {
          motion = largest_motion(step);
          poses_ = candidate;
          if (!model_blocks.empty()) model_motion_ = moved(model_motion_, step.back());
          damping_ = std::max(0.1 * damping_, 1e-9);
          return Outcome::improved;
        }
      }
      damping_ = std::min(10.0 * damping_, 1e3);
    }
    return Outcome::settled;
  }

  Result<void> descend(Refinement& result) {
    const bool has_coarse = options_.coarse_to_fine && std::ranges::any_of(views_, [](const SampledView& view) {
                              return view.points.size() > 2 * view.coarse.size();
                            });
    damping_ = options_.paper_mode ? 1e-3 : 1e-6;
    bool coarse = has_coarse, afresh = true;
    for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
      const std::size_t searched = match_and_scale(coarse, iteration == 0, afresh);
      if (context_.cancelled()) return fail(ErrorCode::cancelled, "cancelled during the joint refinement");
      match_rims(coarse, afresh);
      const std::vector<EdgeSums> sums = linearised(edges_), rim_sums = linearised(rim_edges_);
      EdgeSums total;
      for (const EdgeSums& sum : sums) total += sum;
      if (!(total.weight > 0.0)) {
        return fail(
            ErrorCode::not_possible,
            fmt::format("no point of any view finds a counterpart within {:.3g} mm in a linked view", start_reach()));
      }
      if (iteration == 0) result.rms_before_mm = pooled_rms(sums);
      double motion = 0.0;
      const std::vector<LinkBlock> rims = rim_blocks(sums, rim_sums), model = model_blocks(kOverclaimed);
      const Outcome outcome = take_step(normal_equations(sums, rims, model), rims, model, total.cost, motion);
      result.iterations = iteration + 1;
      context_.report_progress(static_cast<double>(iteration + 1) / static_cast<double>(options_.max_iterations + 1));

      const bool settled = reach_is_settled();
      // Along what the CAD does not hold, a view comes home by rims alone, which takes more than one step.
      if (model_holds_.empty() || iteration >= kStepsAtFullReach) shrink_reach();
      if (outcome == Outcome::settled) damping_ = 1e-6;
      const bool quiet =
          outcome == Outcome::settled || motion < (coarse ? kCoarseMotion : options_.converged_motion) * usual_scale_;
      afresh = false;
      if (!settled || !quiet) continue;
      if (std::exchange(coarse, false)) continue;
      // Kept matches have the last word only if new ones agree, and new ones see the weights that rims have by then.
      const bool reweighed = weigh_rims_by_bias();
      afresh = reweighed || searched < edges_.size();
      if (afresh) continue;
      result.converged = true;
      break;
    }
    return {};
  }

  // Everything that is said about the final poses.
  Result<void> conclude(Refinement& result) {
    find_matches(edges_, views_, poses_, matching_rules(false, false), context_);
    match_rims(false, false);
    const std::vector<EdgeSums> sums = linearised(edges_), rim_sums = linearised(rim_edges_);
    if (context_.cancelled()) return fail(ErrorCode::cancelled, "cancelled during the joint refinement");
    result.rms_after_mm = pooled_rms(sums);
    describe_edges(sums, result);
    const std::vector<Matrix6d> strewn = strewn_blocks(sums, rim_sums);
    // A doubtful match is biased rather than noisy: its small weight would make the pose look as if nothing held it.
    for (DirectedEdge& edge : edges_) {
      for (Match& match : edge.matches) match.weight = 1.0F;
    }
    const std::vector<EdgeSums> plain = linearised(edges_);
    const double variance = unit_variance(plain);
    describe_uncertainty(normal_equations(plain, rim_blocks(plain, rim_sums), model_blocks(1.0)), plain, variance,
                         strewn, result);
    result.firmly_held = is_firmly_held(plain, variance);
    for (std::size_t l = 0; l < links_.size(); ++l) result.link_holds.push_back(hold_of_link(l, both_ways(l, plain)));
    return {};
  }

  [[nodiscard]] bool is_firmly_held(std::span<const EdgeSums> sums, double variance) const {
    std::vector<LinkBlock> blocks;
    for (std::size_t l = 0; l < links_.size(); ++l) {
      const EdgeSums both = both_ways(l, sums);
      const LinkBlock block{links_[l].first, links_[l].second, both.information, Vector6d::Zero(), both.weight};
      blocks.push_back(held_part(block, both, scaling_, std::max(kHeldByFaces, feigned_below(l))));
    }
    const NormalEquations equations(static_cast<int>(views_.size()), fixed_, blocks);
    const std::vector<Matrix6d> inverse = equations.inverse_blocks();
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (static_cast<int>(v) == fixed_) continue;
      if (hold_of_view(v, variance * inverse[v], {}).sigma_mm[0] > kFirmInScales * usual_scale_) return false;
    }
    return true;
  }

  [[nodiscard]] LinkHold hold_of_link(std::size_t link, const EdgeSums& both) const {
    const LocalInformation local = local_information(both, scaling_);
    LinkHold hold{links_[link].first, links_[link].second, local.held, held_threshold(link), {}};
    const Eigen::Index free = (local.held.array() < hold.threshold).count();
    if (local.radius_mm > 0.0) {
      hold.free = slides_and_turns(local.motions.leftCols(free), scaling_.origin + local.centre, local.radius_mm);
    }
    return hold;
  }

  // The same covariance, in mm of the view's own points; `unheld` holds scaled twists.
  [[nodiscard]] ViewHold hold_of_view(std::size_t v, const Matrix6d& scaled_covariance,
                                      const Eigen::Matrix<double, 6, Eigen::Dynamic>& unheld) const {
    const Eigen::Vector3d centre = poses_[v] * views_[v].centroid;
    Matrix6d local_from_scaled = Matrix6d::Identity();
    local_from_scaled.topLeftCorner<3, 3>() *= views_[v].radius_mm / scaling_.length_mm;
    local_from_scaled.bottomLeftCorner<3, 3>() = -cross_matrix(centre - scaling_.origin) / scaling_.length_mm;
    Eigen::Matrix<double, 6, Eigen::Dynamic> basis = local_from_scaled * unheld;
    if (basis.cols() > 0) basis = orthogonal_basis(basis).leftCols(basis.cols()).eval();
    return view_hold(local_from_scaled * scaled_covariance * local_from_scaled.transpose(), basis, centre,
                     views_[v].radius_mm, usual_scale_, diameter_);
  }

  // How far the poses would be strewn by errors that are alike within a part of a view, and different from one such
  // part to the next. In scaled twists.
  [[nodiscard]] std::vector<Matrix6d> strewn_blocks(std::span<const EdgeSums> sums,
                                                    std::span<const EdgeSums> rim_sums) const {
    std::vector<double> radii;
    for (const SampledView& view : views_) radii.push_back(view.radius_mm);
    const double cell_mm = std::max(kAlikeInRadii * median_of(std::move(radii)), 1e-6 * scaling_.length_mm);
    std::vector<CellGradient> cells =
        cell_gradients(edges_, views_, poses_, scaling_, options_.symmetric, cell_mm, context_);
    if (options_.drop_unheld) {
      for (CellGradient& cell : cells) {
        LinkBlock part;
        part.gradient = cell.gradient;
        cell.gradient = held_part(part, both_ways(cell.link, sums), scaling_, held_threshold(cell.link)).gradient;
      }
    }
    // Where faces end errs by itself: cells of their own.
    const std::uint32_t first = cells.empty() ? 0 : cells.back().cell + 1;
    for (CellGradient cell :
         cell_gradients(rim_edges_, views_, poses_, scaling_, options_.symmetric, cell_mm, context_)) {
      cell.cell += first;
      LinkBlock part;
      part.gradient = cell.gradient;
      cell.gradient = part_not_held_by(both_ways(cell.link, sums), part, scaling_, kHeldByFaces).gradient;
      cells.push_back(cell);
    }
    const std::vector<LinkBlock> model = model_blocks(kOverclaimed);
    add_model_cells(model, cells);
    return normal_equations(sums, rim_blocks(sums, rim_sums), model).strewn_blocks(cells);
  }

  // Gradients whose spread is that of a pose that the CAD holds as well as model_holds_ says.
  void add_model_cells(std::span<const LinkBlock> model, std::vector<CellGradient>& cells) const {
    for (std::size_t h = 0; h < model.size(); ++h) {
      const SymmetricEigen<6> eigen(model_holds_[h].information);
      for (Eigen::Index i = 0; i < 6; ++i) {
        const double root = std::sqrt(std::max(0.0, eigen.eigenvalues()[i]));
        const std::uint32_t cell = cells.empty() ? 0 : cells.back().cell + 1;
        cells.push_back({cell, static_cast<std::uint32_t>(links_.size() + h),
                         kOverclaimed * squared(usual_scale_) * root * eigen.eigenvectors().col(i)});
      }
    }
  }

  void describe_uncertainty(const NormalEquations& equations, std::span<const EdgeSums> sums, double variance,
                            std::span<const Matrix6d> strewn, Refinement& result) const {
    const std::vector<Matrix6d> inverse = equations.inverse_blocks();
    const Matrix6d twist_from_scaled = scaling_.twist_from_scaled();
    for (std::size_t v = 0; v < views_.size(); ++v) {
      if (static_cast<int>(v) == fixed_) {
        result.covariance.push_back(Matrix6d::Zero());
        result.view_holds.emplace_back();
        continue;
      }
      const SymmetricEigen<6> eigen(inverse[v]);
      Vector6d variances = Vector6d::Zero();
      const Eigen::Index free = (eigen.eigenvalues().array() > equations.unheld_variance()).count();
      for (int i = 0; i < 6; ++i) {
        const bool unheld = eigen.eigenvalues()[i] > equations.unheld_variance();
        const double unknown = squared(diameter_);
        variances[i] = unheld ? unknown : std::min(unknown, std::max(0.0, variance * eigen.eigenvalues()[i]));
        if (unheld) result.unheld.push_back(unheld_direction(static_cast<int>(v), eigen.eigenvectors().col(i), sums));
      }
      const Matrix6d scaled = eigen.eigenvectors() * variances.asDiagonal() * eigen.eigenvectors().transpose();
      const Matrix6d honest = widened(eigen.eigenvectors(), variances, 6 - free, strewn[v]);
      result.covariance.push_back(twist_from_scaled * honest * twist_from_scaled.transpose());
      result.view_holds.push_back(hold_of_view(v, scaled, eigen.eigenvectors().rightCols(free)));
    }
  }

  [[nodiscard]] UnheldDirection unheld_direction(int view, Vector6d scaled, std::span<const EdgeSums> sums) const {
    Eigen::Index largest = 0;
    scaled.cwiseAbs().maxCoeff(&largest);
    if (scaled[largest] < 0.0) scaled = -scaled;
    double information = 0.0, weight = 0.0;
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (edges_[e].source != view && edges_[e].target != view) continue;
      information += scaled.dot(sums[e].information * scaled);
      weight += sums[e].weight;
    }
    std::vector<Vector6d> step(views_.size(), Vector6d::Zero());
    step[static_cast<std::size_t>(view)] = scaled;
    const double moves = largest_motion(step);
    UnheldDirection direction;
    direction.view = view;
    direction.twist = scaling_.twist_from_scaled() * scaled / (moves > 0.0 ? moves : 1.0);
    direction.eigenvalue = weight > 0.0 ? information / weight : 0.0;
    return direction;
  }

  void describe_edges(std::span<const EdgeSums> sums, Refinement& result) {
    std::vector<DirectedEdge> wide = edges_;
    for (DirectedEdge& edge : wide) {
      edge.reach_mm = start_reach();
      edge.searched = false;
    }
    MatchRules wide_rules = rules(true);
    wide_rules.check_normals = true;
    find_matches(wide, views_, poses_, wide_rules, context_);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      EdgeResidual residual;
      residual.first = edges_[e].source;
      residual.second = edges_[e].target;
      residual.pairs = edges_[e].matches.size();
      residual.rms_mm = sums[e].weight > 0.0 ? std::sqrt(sums[e].weighted_squares / sums[e].weight) : 0.0;
      residual.candidates = wide[e].matches.size();
      residual.spread_mm = residual_statistics(wide[e], views_, poses_).scale_mm;
      result.edges.push_back(residual);
    }
  }

  const RefineOptions& options_;
  const Context& context_;
  std::vector<Link> links_;
  int fixed_;
  std::vector<SampledView> views_;
  std::vector<Pose> poses_;
  std::vector<DirectedEdge> edges_;      // two per link
  std::vector<DirectedEdge> rim_edges_;  // the same two, of the ends of faces; or none
  std::vector<ModelHold> model_holds_;   // one a view, or none
  Pose model_motion_ = Pose::Identity();
  Scaling scaling_;
  double diameter_ = 0.0;
  double usual_scale_ = 0.0;  // median robust scale of the edges: the noise that motion is measured in
  double damping_ = 0.0;
  bool rims_weighed_ = false;  // by what is seen of them
};

}  // namespace

Result<void> RefineOptions::validate() const {
  const auto bad = [](const char* name, double value, const char* range) {
    return fail(ErrorCode::invalid_argument, fmt::format("{} = {} must be {}", name, value, range));
  };
  if (points_per_scan < 100) return bad("points_per_scan", points_per_scan, "at least 100");
  if (max_iterations < 1) return bad("max_iterations", max_iterations, "at least 1");
  if (!(max_normal_angle_deg > 0.0 && max_normal_angle_deg <= 90.0)) {
    return bad("max_normal_angle_deg", max_normal_angle_deg, "in (0, 90]");
  }
  if (!(start_distance_ratio > 0.0 && start_distance_ratio <= 1.0)) {
    return bad("start_distance_ratio", start_distance_ratio, "in (0, 1]");
  }
  if (!(converged_motion > 0.0 && std::isfinite(converged_motion))) {
    return bad("converged_motion", converged_motion, "positive");
  }
  return {};
}

RefineOptions RefineOptions::as_published() const {
  RefineOptions published = *this;
  published.paper_mode = true;
  published.face_normals = published.rim_weights = published.rim_matches = published.reach_weights = false;
  published.edge_weights = published.anneal = published.coarse_to_fine = published.keep_matches = false;
  published.drop_unheld = published.loose_on_model = published.symmetric = false;
  return published;
}

void sample_views(std::span<View> views, const RefineOptions& options, const Context& context) {
  const SamplingRules rules = sampling_rules(options.paper_mode ? options.as_published() : options);
  parallel_for(context, views.size(), 1, [&](std::size_t v) {
    View& view = views[v];
    if (has_sample(view, rules) || !check_view(view, v)) return;
    view.sample =
        std::make_shared<const SampledView>(sampled_view(view.segment_in_scan, view.noise_sigma_mm, rules, context));
  });
}

Result<Refinement> refine(std::span<const View> views, std::span<const Link> links, const RefineOptions& chosen,
                          const Context& context, std::span<const ModelFit> on_model) {
  const RefineOptions options = chosen.paper_mode ? chosen.as_published() : chosen;
  ASBUILT_CHECK(options.validate());
  if (views.empty()) return fail(ErrorCode::invalid_argument, "there are no views to refine");
  if (!on_model.empty() && on_model.size() != views.size()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("{} fits to the CAD are given for {} views", on_model.size(), views.size()));
  }
  for (std::size_t i = 0; i < views.size(); ++i) ASBUILT_CHECK(check_view(views[i], i));
  ASBUILT_TRY(unique_links, check_links(links, static_cast<int>(views.size())));
  return JointRefinement(views, std::move(unique_links), options, on_model, context).run();
}

}  // namespace asbuilt::refine
