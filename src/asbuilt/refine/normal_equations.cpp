// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/normal_equations.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/robust.h"
#include "asbuilt/refine/edge_residual.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kBlock = 2048;
constexpr double kTinyDamping = 1e-11;  // of the mean information: far below any real constraint, far above rounding
constexpr int kDenseUnknowns = 600;     // up to a hundred views a dense factorisation is as quick

struct Task {
  std::size_t edge, begin, end;
};

// Into a frame in which the axes of the present one are the columns of `rotation`, with the same origin.
void turn(EdgeSums& sums, const Eigen::Matrix3d& rotation) {
  Matrix6d both = Matrix6d::Zero();
  both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = rotation;
  const Matrix6d turned = both * sums.information * both.transpose();
  sums.information = 0.5 * (turned + turned.transpose());
  sums.gradient = both * sums.gradient;
  sums.weighted_position = rotation * sums.weighted_position;
}

std::vector<Task> blocks_of(std::span<const DirectedEdge> edges) {
  std::vector<Task> tasks;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const std::size_t count = edges[e].matches.size();
    for (std::size_t i = 0; i < count; i += kBlock) tasks.push_back({e, i, std::min(count, i + kBlock)});
  }
  return tasks;
}

}  // namespace

EdgeSums& EdgeSums::operator+=(const EdgeSums& other) {
  information += other.information;
  gradient += other.gradient;
  cost += other.cost;
  weight += other.weight;
  weighted_squares += other.weighted_squares;
  weighted_position += other.weighted_position;
  weighted_square_position += other.weighted_square_position;
  return *this;
}

Matrix6d Scaling::twist_from_scaled() const {
  // x -> x + w x (x - origin) + t  is the twist (w, t + origin x w).
  Matrix6d result = Matrix6d::Identity();
  result.topLeftCorner<3, 3>() /= length_mm;
  result.bottomLeftCorner<3, 3>() = cross_matrix(origin) / length_mm;
  return result;
}

std::vector<EdgeSums> linearise(std::span<const DirectedEdge> edges, std::span<const SampledView> views,
                                std::span<const Pose> poses, const Scaling& scaling, bool symmetric,
                                const Context& context) {
  const std::vector<Task> tasks = blocks_of(edges);
  std::vector<EdgeSums> partial(tasks.size());
  parallel_for(context, tasks.size(), 1, [&](std::size_t t) {
    const DirectedEdge& edge = edges[tasks[t].edge];
    const EdgeResidualFunction residual_of(edge, views, poses, scaling.origin, symmetric);
    const TukeyLoss loss{edge.scale_mm};
    EdgeSums sums;
    for (std::size_t i = tasks[t].begin; i < tasks[t].end; ++i) {
      residual_of.fetch_ahead(i);
      ResidualWithJacobian r = residual_of(i);
      r.jacobian.head<3>() /= scaling.length_mm;
      const double squared = r.residual * r.residual;
      const double match_weight = edge.weight * static_cast<double>(edge.matches[i].weight);
      const double weight = match_weight * loss.weight(squared);
      sums.cost += match_weight * loss.value(squared);
      if (weight <= 0.0) continue;
      const Vector6d weighted = weight * r.jacobian;
      sums.information.noalias() += weighted * r.jacobian.transpose();
      sums.gradient += r.residual * weighted;
      sums.weight += weight;
      sums.weighted_squares += weight * squared;
      const Eigen::Vector3d position = residual_of.position(i);
      sums.weighted_position += weight * position;
      sums.weighted_square_position += weight * position.squaredNorm();
    }
    turn(sums, residual_of.rotation());
    partial[t] = sums;
  });
  std::vector<EdgeSums> total(edges.size());
  for (std::size_t t = 0; t < tasks.size(); ++t) total[tasks[t].edge] += partial[t];
  return total;
}

double total_cost(std::span<const DirectedEdge> edges, std::span<const SampledView> views, std::span<const Pose> poses,
                  bool symmetric, const Context& context) {
  const std::vector<Task> tasks = blocks_of(edges);
  return sum_in_fixed_order(context, tasks.size(), 1, 0.0, [&](double& sum, std::size_t t) {
    const DirectedEdge& edge = edges[tasks[t].edge];
    const EdgeResidualFunction residual_of(edge, views, poses, Eigen::Vector3d::Zero(), symmetric);
    const TukeyLoss loss{edge.scale_mm};
    for (std::size_t i = tasks[t].begin; i < tasks[t].end; ++i) {
      residual_of.fetch_ahead(i);
      const double residual = residual_of.residual(i);
      sum += edge.weight * static_cast<double>(edge.matches[i].weight) * loss.value(residual * residual);
    }
  });
}

LocalInformation local_information(const EdgeSums& both_ways, const Scaling& scaling) {
  LocalInformation local;
  if (!(both_ways.weight > 0.0)) return local;
  local.centre = both_ways.weighted_position / both_ways.weight;
  const double variance = both_ways.weighted_square_position / both_ways.weight - local.centre.squaredNorm();
  const double radius = std::sqrt(std::max(variance, 0.0));
  if (!(radius > 1e-9 * scaling.length_mm)) return local;
  local.radius_mm = radius;
  local.scaled_from_local.topLeftCorner<3, 3>() *= scaling.length_mm / radius;
  local.scaled_from_local.bottomLeftCorner<3, 3>() = cross_matrix(local.centre) / radius;
  const SymmetricEigen<6> eigen(local.scaled_from_local.transpose() * both_ways.information * local.scaled_from_local /
                                both_ways.weight);
  local.held = eigen.eigenvalues();
  local.motions = eigen.eigenvectors();
  return local;
}

namespace {

// The directions that are held with at least `threshold`, or the others.
Matrix6d projector(const LocalInformation& local, double threshold, bool held) {
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i) {
    if ((local.held[i] >= threshold) == held) sum += local.motions.col(i) * local.motions.col(i).transpose();
  }
  return sum;
}

LinkBlock projected(const LinkBlock& link, const LocalInformation& local, const Matrix6d& projector) {
  // Of twists; its transpose acts on gradients.
  const Matrix6d kept = local.scaled_from_local * projector * local.scaled_from_local.inverse();
  LinkBlock part = link;
  part.gradient = kept.transpose() * link.gradient;
  part.information = kept.transpose() * link.information * kept;
  return part;
}

}  // namespace

LinkBlock held_part(const LinkBlock& link, const EdgeSums& both_ways, const Scaling& scaling, double threshold) {
  const LocalInformation local = local_information(both_ways, scaling);
  if (!(local.radius_mm > 0.0)) {  // a single point holds nothing worth having
    LinkBlock nothing = link;
    nothing.information.setZero();
    nothing.gradient.setZero();
    return nothing;
  }
  if (local.held[0] >= threshold) return link;
  return projected(link, local, projector(local, threshold, true));
}

LinkBlock part_not_held_by(const EdgeSums& both_ways, const LinkBlock& link, const Scaling& scaling, double threshold) {
  const LocalInformation local = local_information(both_ways, scaling);
  if (!(local.radius_mm > 0.0)) return link;
  return projected(link, local, projector(local, threshold, false));
}

int NormalEquations::unknown_of(int view) const {
  if (view == fixed_view_) return -1;
  return 6 * (view < fixed_view_ ? view : view - 1);
}

NormalEquations::NormalEquations(int views, int fixed_view, std::span<const LinkBlock> links)
    : views_(views), fixed_view_(fixed_view), links_(links.begin(), links.end()) {
  gradient_ = Eigen::VectorXd::Zero(6 * (views - 1));
  diagonal_ = Eigen::VectorXd::Zero(6 * (views - 1));
  for (const LinkBlock& link : links_) {
    const int a = unknown_of(link.first), b = unknown_of(link.second);
    if (a >= 0) gradient_.segment<6>(a) += link.gradient;
    if (b >= 0) gradient_.segment<6>(b) -= link.gradient;
    if (a >= 0) diagonal_.segment<6>(a) += link.information.diagonal();
    if (b >= 0) diagonal_.segment<6>(b) += link.information.diagonal();
  }
  mean_information_ = diagonal_.size() > 0 ? diagonal_.mean() : 0.0;
}

namespace {

// Calls add(row, column, block) for each 6x6 block of the normal matrix, both triangles.
template <class UnknownOf, class Add>
void for_each_block(std::span<const LinkBlock> links, const UnknownOf& unknown_of, const Add& add) {
  for (const LinkBlock& link : links) {
    const int a = unknown_of(link.first), b = unknown_of(link.second);
    if (a >= 0) add(a, a, link.information);
    if (b >= 0) add(b, b, link.information);
    if (a >= 0 && b >= 0) {
      add(a, b, -link.information);
      add(b, a, -link.information);
    }
  }
}

template <class UnknownOf>
Eigen::MatrixXd dense_matrix(std::span<const LinkBlock> links, Eigen::Index size, const UnknownOf& unknown_of) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  for_each_block(links, unknown_of,
                 [&](int row, int column, const Matrix6d& block) { matrix.block<6, 6>(row, column) += block; });
  return matrix;
}

template <class UnknownOf>
Eigen::SparseMatrix<double> sparse_matrix(std::span<const LinkBlock> links, Eigen::Index size,
                                          const UnknownOf& unknown_of) {
  std::vector<Eigen::Triplet<double>> entries;
  for_each_block(links, unknown_of, [&](int row, int column, const Matrix6d& block) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) entries.emplace_back(row + i, column + j, block(i, j));
    }
  });
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

}  // namespace

std::vector<Vector6d> NormalEquations::step(double damping, bool marquardt) const {
  const Eigen::Index size = gradient_.size();
  if (size == 0 || !(mean_information_ > 0.0)) return {};
  const auto unknown = [this](int view) { return unknown_of(view); };
  Eigen::VectorXd extra = Eigen::VectorXd::Constant(size, kTinyDamping * mean_information_);
  if (marquardt) {
    extra += damping * diagonal_;
  } else {
    extra.array() += damping * mean_information_;
  }
  Eigen::VectorXd solution;
  if (size <= kDenseUnknowns) {
    Eigen::MatrixXd matrix = dense_matrix(links_, size, unknown);
    matrix.diagonal() += extra;
    solution = matrix.ldlt().solve(-gradient_);
  } else {
    Eigen::SparseMatrix<double> matrix = sparse_matrix(links_, size, unknown);
    matrix += Eigen::SparseMatrix<double>(extra.asDiagonal());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    if (solver.info() != Eigen::Success) return {};
    solution = solver.solve(-gradient_);
  }
  if (!solution.allFinite()) return {};
  std::vector<Vector6d> twists(static_cast<std::size_t>(views_), Vector6d::Zero());
  for (int view = 0; view < views_; ++view) {
    if (view != fixed_view_) twists[static_cast<std::size_t>(view)] = solution.segment<6>(unknown_of(view));
  }
  return twists;
}

template <class Solver>
std::vector<Matrix6d> NormalEquations::blocks_with(const Solver& solver) const {
  std::vector<Matrix6d> blocks(static_cast<std::size_t>(views_), Matrix6d::Zero());
  for (int view = 0; view < views_; ++view) {
    if (view == fixed_view_) continue;
    const int at = unknown_of(view);
    Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(gradient_.size(), 6);
    unit.block<6, 6>(at, 0).setIdentity();
    const Eigen::MatrixXd columns = solver.solve(unit);
    const Matrix6d block = columns.block<6, 6>(at, 0);
    blocks[static_cast<std::size_t>(view)] = 0.5 * (block + block.transpose());
  }
  return blocks;
}

template <class Solver>
std::vector<Matrix6d> NormalEquations::strewn_with(const Solver& solver, std::span<const CellGradient> cells) const {
  constexpr std::uint32_t kTogether = 128;  // columns, so that memory does not grow with the number of cells
  std::vector<Matrix6d> blocks(static_cast<std::size_t>(views_), Matrix6d::Zero());
  for (std::size_t begin = 0, end = 0; begin < cells.size(); begin = end) {
    const std::uint32_t first_cell = cells[begin].cell;
    while (end < cells.size() && cells[end].cell - first_cell < kTogether) ++end;
    Eigen::MatrixXd gradients =
        Eigen::MatrixXd::Zero(gradient_.size(), Eigen::Index{cells[end - 1].cell - first_cell} + 1);
    for (const CellGradient& cell : cells.subspan(begin, end - begin)) {
      const LinkBlock& link = links_[cell.link];
      const int a = unknown_of(link.first), b = unknown_of(link.second);
      const Eigen::Index column = cell.cell - first_cell;
      if (a >= 0) gradients.col(column).segment<6>(a) += cell.gradient;
      if (b >= 0) gradients.col(column).segment<6>(b) -= cell.gradient;
    }
    const Eigen::MatrixXd responses = solver.solve(gradients);
    for (int view = 0; view < views_; ++view) {
      if (view == fixed_view_) continue;
      const auto rows = responses.middleRows<6>(unknown_of(view));
      blocks[static_cast<std::size_t>(view)] += rows * rows.transpose();
    }
  }
  return blocks;
}

template <class Work>
auto NormalEquations::with_solver(const Work& work) const {
  const Eigen::Index size = gradient_.size();
  const auto unknown = [this](int view) { return unknown_of(view); };
  const double tiny = mean_information_ > 0.0 ? kTinyDamping * mean_information_ : 1.0;
  if (size <= kDenseUnknowns) {
    Eigen::MatrixXd matrix = dense_matrix(links_, size, unknown);
    matrix.diagonal().array() += tiny;
    return work(Eigen::LDLT<Eigen::MatrixXd>(matrix));
  }
  Eigen::SparseMatrix<double> matrix = sparse_matrix(links_, size, unknown);
  matrix += Eigen::SparseMatrix<double>(Eigen::VectorXd::Constant(size, tiny).asDiagonal());
  return work(Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix));
}

std::vector<Matrix6d> NormalEquations::inverse_blocks() const {
  return with_solver([&](const auto& solver) { return blocks_with(solver); });
}

std::vector<Matrix6d> NormalEquations::strewn_blocks(std::span<const CellGradient> cells) const {
  return with_solver([&](const auto& solver) { return strewn_with(solver, cells); });
}

double NormalEquations::unheld_variance() const {
  return mean_information_ > 0.0 ? 1e-2 / (kTinyDamping * mean_information_) : 0.5;
}

}  // namespace asbuilt::refine
