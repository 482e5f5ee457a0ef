// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/inspect/extremum.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace asbuilt::inspect {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kLeast = 12;      // three unknowns of the field, and enough to tell them
constexpr double kMostNodes = 200.0;    // the cost grows with the third power
constexpr double kFence = 3.0;          // interquartile ranges: Tukey's outer fences
constexpr std::size_t kNeighbours = 8;  // that quartiles can be told of
constexpr double kNoiseFloor = 1e-6;    // of the field's variance: keeps places that coincide apart

/// Heights by the squares of a grid about the origin.
class Squares {
 public:
  Squares(std::span<const Vector3d> heights, double edge) : edge_(edge) {
    double furthest = 0.0;
    for (const Vector3d& p : heights) furthest = std::max(furthest, p.head<2>().lpNorm<Eigen::Infinity>());
    half_ = static_cast<int>(std::ceil(furthest / edge)) + 1;  // one more all round, so that all have neighbours
    squares_.resize(static_cast<std::size_t>(4 * half_ * half_));
    for (const Vector3d& p : heights) squares_[at(column(p.x()), column(p.y()))].push_back(p);
  }

  [[nodiscard]] int count() const { return 2 * half_; }
  [[nodiscard]] int column(double x) const { return static_cast<int>(std::floor(x / edge_)) + half_; }
  [[nodiscard]] std::vector<Vector3d>& square(int i, int j) { return squares_[at(i, j)]; }

  /// What lies in a square and around it.
  [[nodiscard]] std::vector<Vector3d> around(int i, int j) const {
    std::vector<Vector3d> found;
    for (int y = std::max(j - 1, 0); y <= std::min(j + 1, count() - 1); ++y) {
      for (int x = std::max(i - 1, 0); x <= std::min(i + 1, count() - 1); ++x) {
        const auto& here = squares_[at(x, y)];
        found.insert(found.end(), here.begin(), here.end());
      }
    }
    return found;
  }

 private:
  [[nodiscard]] std::size_t at(int i, int j) const { return static_cast<std::size_t>(j * count() + i); }

  double edge_;
  int half_ = 1;
  std::vector<std::vector<Vector3d>> squares_;
};

double quantile(std::vector<double>& values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, place);
  return *place;
}

std::vector<Vector3d> without_outliers(std::span<const Vector3d> heights, double edge) {
  Squares squares(heights, edge);
  std::vector<Vector3d> kept;
  std::vector<double> about;
  for (int j = 0; j < squares.count(); ++j) {
    for (int i = 0; i < squares.count(); ++i) {
      if (squares.square(i, j).empty()) continue;
      about.clear();
      for (const Vector3d& p : squares.around(i, j)) about.push_back(p.z());
      double low = -std::numeric_limits<double>::infinity(), high = -low;
      if (about.size() > kNeighbours) {
        const double first = quantile(about, 0.25), third = quantile(about, 0.75);
        low = first - kFence * (third - first);
        high = third + kFence * (third - first);
      }
      for (const Vector3d& p : squares.square(i, j)) {
        if (p.z() >= low && p.z() <= high) kept.push_back(p);
      }
    }
  }
  return kept;
}

/// Places with the heights at them, each a mean of so many.
struct Nodes {
  std::vector<Vector2d> places;
  Eigen::VectorXd heights, counts;
};

Nodes nodes_of(std::span<const Vector3d> heights, double edge) {
  Squares squares(heights, edge);
  std::vector<Vector3d> means;
  std::vector<double> counts;
  for (int j = 0; j < squares.count(); ++j) {
    for (int i = 0; i < squares.count(); ++i) {
      const std::vector<Vector3d>& here = squares.square(i, j);
      if (here.empty()) continue;
      Vector3d sum = Vector3d::Zero();
      for (const Vector3d& p : here) sum += p;
      counts.push_back(static_cast<double>(here.size()));
      means.emplace_back(sum / counts.back());
    }
  }
  Nodes nodes;
  const auto n = static_cast<Eigen::Index>(means.size());
  nodes.heights.resize(n);
  nodes.counts = Eigen::Map<const Eigen::VectorXd>(counts.data(), n);
  for (Eigen::Index i = 0; i < n; ++i) {
    nodes.places.emplace_back(means[static_cast<std::size_t>(i)].head<2>());
    nodes.heights[i] = means[static_cast<std::size_t>(i)].z();
  }
  return nodes;
}

/// The random field that heights at nodes were drawn from: an unknown mean, a Matern covariance of order 3/2, noise.
class Field {
 public:
  explicit Field(Nodes nodes) : nodes_(std::move(nodes)), distances_(size(), size()) {
    for (Eigen::Index j = 0; j < size(); ++j) {
      for (Eigen::Index i = 0; i < size(); ++i) distances_(i, j) = (place(i) - place(j)).norm();
    }
  }

  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(nodes_.places.size()); }
  [[nodiscard]] const Vector2d& place(Eigen::Index i) const { return nodes_.places[static_cast<std::size_t>(i)]; }

  /// Takes the range and the ratio of noise to signal under which the heights are most likely: a coarse grid of both,
  /// then finer steps about its best.
  void fit(double reach) {
    double best = -std::numeric_limits<double>::infinity(), range = reach, noise = 1e-2;
    const auto consider = [&](double a_range, double a_noise) {
      const double likelihood = solve(a_range, std::max(a_noise, kNoiseFloor));
      if (likelihood <= best) return;
      best = likelihood, range = a_range, noise = a_noise;
    };
    for (const double share : {0.15, 0.3, 0.6, 1.2, 2.4, 4.8}) {
      for (const double ratio : {1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0}) consider(share * reach, ratio);
    }
    double step = 1.0;
    for (int round = 0; round < 2; ++round, step *= 0.5) {
      const double around_range = range, around_noise = noise;
      for (const double sign : {-1.0, 1.0}) {
        consider(around_range, around_noise * std::pow(10.0, 0.5 * sign * step));
        consider(around_range * std::pow(2.0, 0.5 * sign * step), noise);
      }
    }
    solve(range, std::max(noise, kNoiseFloor));
  }

  /// Of the surface at a place, without the variance.
  [[nodiscard]] double height(const Vector2d& at) const { return mean_ + correlations(at).dot(weights_); }

  [[nodiscard]] double variance(const Vector2d& at) const {
    const Eigen::VectorXd near = correlations(at);
    const double known = near.dot(factor_.solve(near));
    const double of_mean = 1.0 - near.dot(of_ones_);  // what the unknown mean has to fill in
    return signal_ * std::max(0.0, 1.0 - known + of_mean * of_mean / of_ones_.sum());
  }

 private:
  [[nodiscard]] double correlation(double distance) const {
    const double t = std::numbers::sqrt3 * distance / range_;
    return (1.0 + t) * std::exp(-t);
  }
  [[nodiscard]] Eigen::VectorXd correlations(const Vector2d& at) const {
    return Eigen::VectorXd::NullaryExpr(size(), [&](Eigen::Index i) { return correlation((place(i) - at).norm()); });
  }

  /// Solves for a range and a ratio of the noise of one point to the signal, both as variances; gives the restricted
  /// log-likelihood, up to a constant.
  double solve(double range, double noise) {
    range_ = range;
    Eigen::MatrixXd covariance = distances_.unaryExpr([this](double distance) { return correlation(distance); });
    covariance.diagonal() += noise * nodes_.counts.cwiseInverse();
    factor_.compute(covariance);
    if (factor_.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
    of_ones_ = factor_.solve(Eigen::VectorXd::Ones(size()));
    const Eigen::VectorXd of_heights = factor_.solve(nodes_.heights);
    mean_ = of_heights.sum() / of_ones_.sum();
    weights_ = of_heights - mean_ * of_ones_;
    const auto freedom = static_cast<double>(size() - 1);
    signal_ = std::max((nodes_.heights.array() - mean_).matrix().dot(weights_) / freedom, 1e-300);
    const double log_determinant = 2.0 * factor_.matrixLLT().diagonal().array().log().sum();
    return -0.5 * (freedom * std::log(signal_) + log_determinant + std::log(of_ones_.sum()));
  }

  Nodes nodes_;
  Eigen::MatrixXd distances_;
  double range_ = 1.0, signal_ = 0.0, mean_ = 0.0;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd of_ones_, weights_;
};

}  // namespace

std::optional<Extremum> extremum_of(std::span<const Vector3d> heights, double sign, double reach) {
  // So that about kMostNodes squares are filled by a disc of that reach.
  const double edge = reach * std::sqrt(std::numbers::pi / kMostNodes);
  std::vector<Vector3d> upwards(heights.begin(), heights.end());
  for (Vector3d& p : upwards) p.z() *= sign;
  const std::vector<Vector3d> kept = without_outliers(upwards, edge);
  // Squares that would hold a few points each are made so small that each holds one: a mean levels, if little.
  const double filled = static_cast<double>(kept.size()) > kMostNodes ? edge : 0.25 * edge;
  Nodes nodes = nodes_of(kept, filled);
  if (nodes.places.size() < kLeast) return std::nullopt;
  Field field(std::move(nodes));
  field.fit(reach);

  std::optional<Extremum> best;
  const auto consider = [&](const Vector2d& place) {
    if (place.norm() > reach) return;
    const double height = field.height(place);
    if (!best || height > best->height) best = Extremum{place, height, 0.0};
  };
  for (Eigen::Index i = 0; i < field.size(); ++i) consider(field.place(i));
  if (!best) return std::nullopt;
  // The top lies between nodes as a rule. Ways towards measured places do not leave what was measured.
  Squares squares(kept, edge);
  const std::vector<Vector3d> near = squares.around(squares.column(best->place.x()), squares.column(best->place.y()));
  for (const double share : {1.0, 0.5, 0.25}) {
    const Vector2d from = best->place;
    for (const Vector3d& p : near) consider(from + share * (p.head<2>() - from));
  }
  best->variance = field.variance(best->place);
  best->height *= sign;
  return best;
}

}  // namespace asbuilt::inspect
