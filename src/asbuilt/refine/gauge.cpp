// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/refine/gauge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/median.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/robust.h"
#include "asbuilt/refine/normal_equations.h"
#include "asbuilt/refine/sampled_view.h"

namespace asbuilt::refine {
namespace {

constexpr std::size_t kPointsPerView = 6000, kPoints = 6000;
constexpr double kReachRatio = 0.05;       // of the diameter
constexpr double kRoughReachRatio = 0.15;  // a start 6 degrees and 5 % off leaves points so far away
constexpr std::size_t kRoughPoints = 2000;
constexpr double kRoughOffRatio = 0.01;  // of the diameter: further off than parts deviate from their CAD ...
constexpr double kRoughShare = 0.1;      // ... if it is more of the points than a few dents explain
constexpr double kRoughTurn = 0.1, kRoughShiftRatio = 0.05;  // radians, of the diameter: from there a fit begins, too
constexpr double kTukeyTuning = 4.685;
constexpr double kScaleDecay = 0.5;   // of the loss from step to step, at most
constexpr double kSameSide = 0.3;     // cosine between scan normal and surface normal
constexpr double kUnheld = 5e-4;      // information below this share of a full one moves nothing
constexpr double kStillRatio = 1e-7;  // of the diameter: a step this small ends the search
constexpr int kMaxSteps = 60;
constexpr double kPatches = 3.0;  // of a view that deviate independently; with ten, errors were 2 to 4 times the claims

// Even over a view, moved by a pose.
PointCloud sampled_at(const View& view, const Pose& moved_from_scan, std::size_t most, const Context& context) {
  PointCloud points = evenly_sampled(view.segment_in_scan, most, context);
  for (Eigen::Vector3f& point : points.positions) point = (moved_from_scan * point.cast<double>()).cast<float>();
  for (Eigen::Vector3f& normal : points.normals) {
    normal = (moved_from_scan.linear() * normal.cast<double>()).cast<float>();
  }
  return points;
}

// Even over the union of all views, in the refined frame.
PointCloud even_union(std::span<const View> views, std::span<const Pose> refined_from_scan, const Context& context) {
  PointCloud all;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const PointCloud sample = sampled_at(views[v], refined_from_scan[v], kPointsPerView, context);
    all.positions.insert(all.positions.end(), sample.positions.begin(), sample.positions.end());
    all.normals.insert(all.normals.end(), sample.normals.begin(), sample.normals.end());
  }
  return evenly_sampled(all, kPoints, context);
}

struct Residual {
  bool used = false;
  double distance = 0.0;                               // signed
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // moved
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  // of the signed distance
};

struct Sums {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0, weight = 0.0;

  Sums& operator+=(const Sums& other) {
    information += other.information;
    gradient += other.gradient;
    cost += other.cost;
    weight += other.weight;
    return *this;
  }
};

class GaugeFit {
 public:
  GaugeFit(const PointCloud& points, const model::SurfaceDistance& surface, double diameter, double reach_ratio,
           const Context& context)
      : points_(points), surface_(surface), diameter_(diameter), reach_(reach_ratio * diameter), context_(context) {
    for (const Eigen::Vector3f& point : points.positions) centre_ += point.cast<double>();
    centre_ /= static_cast<double>(points.size());
    double squares = 0.0;
    for (const Eigen::Vector3f& point : points.positions) squares += (point.cast<double>() - centre_).squaredNorm();
    length_ = std::max(std::sqrt(squares / static_cast<double>(points.size())), 1e-9 * diameter);
  }

  // From `start`, a motion of the points as they are given.
  Result<Pose> run(const Pose& start = Pose::Identity()) {
    pose_ = start;
    double scale = reach_;
    double damping = 1e-6;
    std::vector<Residual> residuals = residuals_at(pose_);
    for (int iteration = 0; iteration < kMaxSteps; ++iteration) {
      if (context_.cancelled()) return fail(ErrorCode::cancelled, "cancelled during the fit to the CAD");
      const double wanted = kTukeyTuning * std::max(spread(residuals), 1e-6 * diameter_);
      const double next = std::max(wanted, kScaleDecay * scale);
      const bool annealed = next > 0.95 * scale;
      scale = std::min(scale, next);
      const Sums sums = sums_of(residuals, scale);
      if (!(sums.weight > 0.0)) {
        return fail(ErrorCode::not_possible,
                    fmt::format("no scanned point lies within {:.3g} mm of the CAD surface", reach_));
      }
      double motion = 0.0;
      for (int attempt = 0; attempt < 8; ++attempt) {
        const Vector6d step = held_step(sums, damping);
        const Pose candidate = moved(step);
        std::vector<Residual> there = residuals_at(candidate);
        if (sums_of(there, scale).cost < sums.cost) {
          motion = step.norm();
          pose_ = candidate;
          residuals = std::move(there);
          damping = std::max(0.1 * damping, 1e-9);
          break;
        }
        if (step.norm() < kStillRatio * diameter_) break;
        damping = std::min(10.0 * damping, 1e6);
      }
      if (annealed && motion < kStillRatio * diameter_) break;
    }
    return pose_;
  }

  // About the pose that run() found, of the twist on its left.
  [[nodiscard]] Matrix6d information() const {
    const std::vector<Residual> residuals = residuals_at(pose_);
    const double deviation = std::max(spread(residuals), 1e-6 * diameter_);
    const Sums sums = sums_of(residuals, kTukeyTuning * deviation);
    if (!(sums.weight > 0.0)) return Matrix6d::Zero();
    const SymmetricEigen<6> eigen(sums.information / sums.weight);
    const Vector6d held = (eigen.eigenvalues().array() < kUnheld).select(0.0, eigen.eigenvalues());
    const Matrix6d scaled = eigen.eigenvectors() * held.asDiagonal() * eigen.eigenvectors().transpose();
    const Matrix6d scaled_from_twist = Scaling{centre_, length_}.twist_from_scaled().inverse();
    return kPatches / (deviation * deviation) * scaled_from_twist.transpose() * scaled * scaled_from_twist;
  }

  // Share of the points that lie further off the CAD than parts deviate from theirs, or face away from it.
  [[nodiscard]] double share_off(const Pose& pose) const {
    std::size_t off = 0;
    for (const Residual& residual : residuals_at(pose)) {
      off += residual.used && std::abs(residual.distance) <= kRoughOffRatio * diameter_ ? 0 : 1;
    }
    return static_cast<double>(off) / static_cast<double>(points_.size());
  }

  // Turned and shifted both ways about and along three axes through the middle of the points.
  [[nodiscard]] std::vector<Pose> starts_around() const {
    std::vector<Pose> starts;
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (const double sign : {1.0, -1.0}) {
        const double by = i < 3 ? kRoughTurn * length_ : kRoughShiftRatio * diameter_;
        starts.push_back(moved(sign * by * Vector6d::Unit(i)));
      }
    }
    return starts;
  }

 private:
  [[nodiscard]] std::vector<Residual> residuals_at(const Pose& pose) const {
    std::vector<Residual> residuals(points_.size());
    parallel_for(context_, points_.size(), 256, [&](std::size_t i) {
      const Eigen::Vector3d position = pose * points_.positions[i].cast<double>();
      const Eigen::Vector3d normal = pose.linear() * points_.normals[i].cast<double>();
      const auto nearest = surface_.nearest(position, reach_);
      if (!nearest.found() || nearest.on_open_edge) return;
      Residual& residual = residuals[i];
      residual.position = position;
      residual.distance = nearest.signed_distance;
      // On the surface itself the direction to the nearest point has no digits left; the scan's normal stands in.
      const bool has_direction = std::abs(nearest.signed_distance) > 1e-7 * diameter_;
      residual.gradient = has_direction ? ((position - nearest.point) / nearest.signed_distance).eval() : normal;
      residual.used = residual.gradient.dot(normal) > kSameSide;
    });
    return residuals;
  }

  [[nodiscard]] static double spread(const std::vector<Residual>& residuals) {
    std::vector<double> distances;
    for (const Residual& residual : residuals) {
      if (residual.used) distances.push_back(std::abs(residual.distance));
    }
    if (distances.empty()) return 0.0;
    return 1.4826 * median_of(std::move(distances));
  }

  // A point off reach or on the wrong side costs as much as one beyond the loss: losing points never looks like a gain.
  [[nodiscard]] Sums sums_of(const std::vector<Residual>& residuals, double scale) const {
    const TukeyLoss loss{scale};
    return sum_in_fixed_order(context_, residuals.size(), 1024, Sums{}, [&](Sums& sums, std::size_t i) {
      const Residual& residual = residuals[i];
      if (!residual.used) {
        sums.cost += loss.value(scale * scale);
        return;
      }
      const double squared = residual.distance * residual.distance;
      const double weight = loss.weight(squared);
      Vector6d jacobian;
      jacobian << (residual.position - centre_).cross(residual.gradient) / length_, residual.gradient;
      sums.information += weight * jacobian * jacobian.transpose();
      sums.gradient += weight * residual.distance * jacobian;
      sums.cost += loss.value(squared);
      sums.weight += weight;
    });
  }

  [[nodiscard]] static Vector6d held_step(const Sums& sums, double damping) {
    const SymmetricEigen<6> eigen(sums.information / sums.weight);
    const Vector6d along = eigen.eigenvectors().transpose() * (sums.gradient / sums.weight);
    Vector6d step = Vector6d::Zero();
    for (int i = 0; i < 6; ++i) {
      if (eigen.eigenvalues()[i] < kUnheld) continue;
      step -= along[i] / (eigen.eigenvalues()[i] + damping) * eigen.eigenvectors().col(i);
    }
    return step;
  }

  [[nodiscard]] Pose moved(const Vector6d& scaled_step) const {
    const Eigen::Matrix3d rotation = rotation_from_axis_angle(scaled_step.head<3>() / length_);
    Pose pose = pose_;
    pose.linear() = rotation * pose_.linear();
    pose.translation() = rotation * (pose_.translation() - centre_) + centre_ + scaled_step.tail<3>();
    return orthonormalised(pose);
  }

  const PointCloud& points_;
  const model::SurfaceDistance& surface_;
  double diameter_, reach_;
  const Context& context_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double length_ = 1.0;
  Pose pose_ = Pose::Identity();
};

Result<void> check_fitted(const View& view, double diameter_mm) {
  if (!(diameter_mm > 0.0 && std::isfinite(diameter_mm))) {
    return fail(ErrorCode::invalid_argument, fmt::format("the diameter is {} mm", diameter_mm));
  }
  if (view.segment_in_scan.normals.size() == view.segment_in_scan.size()) return {};
  return fail(ErrorCode::invalid_argument, "the view has not one normal a point");
}

}  // namespace

Result<Pose> best_fit_gauge(std::span<const View> views, std::span<const Pose> refined_from_scan,
                            const model::SurfaceDistance& surface, double diameter_mm, const Context& context) {
  if (views.size() != refined_from_scan.size()) {
    return fail(ErrorCode::invalid_argument,
                fmt::format("{} poses are given for {} views", refined_from_scan.size(), views.size()));
  }
  if (!(diameter_mm > 0.0 && std::isfinite(diameter_mm))) {
    return fail(ErrorCode::invalid_argument, fmt::format("the diameter is {} mm", diameter_mm));
  }
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (views[v].segment_in_scan.normals.size() != views[v].segment_in_scan.size()) {
      return fail(ErrorCode::invalid_argument, fmt::format("view {} has not one normal a point", v));
    }
  }
  const PointCloud points = even_union(views, refined_from_scan, context);
  if (points.empty()) return fail(ErrorCode::not_possible, "there are no scanned points to fit to the CAD");
  return GaugeFit(points, surface, diameter_mm, kReachRatio, context).run();
}

Result<ModelFit> fit_to_model(const View& view, const model::SurfaceDistance& surface, double diameter_mm,
                              const Context& context) {
  ASBUILT_CHECK(check_fitted(view, diameter_mm));
  if (view.segment_in_scan.empty()) {
    return fail(ErrorCode::not_possible, "there are no scanned points to fit to the CAD");
  }
  const PointCloud points = sampled_at(view, view.model_from_scan, kRoughPoints, context);
  GaugeFit fit(points, surface, diameter_mm, kReachRatio, context);
  ASBUILT_TRY(motion, fit.run());
  return ModelFit{orthonormalised(motion * view.model_from_scan), fit.information(), fit.share_off(motion)};
}

Result<Pose> start_near_model(const View& view, const model::SurfaceDistance& surface, double diameter_mm,
                              const Context& context) {
  ASBUILT_CHECK(check_fitted(view, diameter_mm));
  if (view.segment_in_scan.empty()) return view.model_from_scan;
  const PointCloud points = sampled_at(view, view.model_from_scan, kRoughPoints, context);
  GaugeFit fit(points, surface, diameter_mm, kRoughReachRatio, context);
  const double before = fit.share_off(Pose::Identity());
  if (before <= kRoughShare) return view.model_from_scan;
  std::vector<Pose> starts = fit.starts_around();
  starts.insert(starts.begin(), Pose::Identity());
  Pose best = Pose::Identity();
  double least = before;
  for (const Pose& start : starts) {
    const auto motion = fit.run(start);
    if (!motion && motion.error().code == ErrorCode::cancelled) return motion;
    if (!motion) continue;
    const double left = fit.share_off(*motion);
    if (left >= least) continue;
    least = left;
    best = *motion;
    if (least <= kRoughShare) break;  // on the CAD: the others can only find the same place
  }
  if (least > 0.5 * before) return view.model_from_scan;  // no better there
  return orthonormalised(best * view.model_from_scan);
}

}  // namespace asbuilt::refine
