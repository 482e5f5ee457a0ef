// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/lm_icp.h"

#include <array>
#include <cmath>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/robust.h"
#include "asbuilt/verify/sensor_in_model.h"

namespace asbuilt::verify {
namespace {

constexpr float kAway = -0.1F;  // cosine of the incidence from which a wall is turned away from the sensor

struct NormalEquations {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;
  double squared = 0.0;
  std::size_t inliers = 0;
};

// The lower triangle of the information, row by row: the inner loop's sums stay in one short array.
class PackedInformation {
 public:
  void add(const Vector6d& derivative, double weight) {
    std::size_t k = 0;
    for (int row = 0; row < 6; ++row) {
      const double weighted = weight * derivative[row];
      for (int column = 0; column <= row; ++column) sum_[k++] += weighted * derivative[column];
    }
  }
  [[nodiscard]] Matrix6d matrix() const {
    Matrix6d full;
    std::size_t k = 0;
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column <= row; ++column) full(row, column) = full(column, row) = sum_[k++];
    }
    return full;
  }

 private:
  std::array<double, 21> sum_{};
};

class Problem {
 public:
  Problem(std::span<const Eigen::Vector3f> points, const model::PreparedModel& model, const scan::Viewpoint& viewpoint,
          const LmIcpOptions& options)
      : points_(points), model_(model), viewpoint_(viewpoint), options_(options), loss_{options.robust_scale_mm} {
    pivot_ = model.box.center();
  }

  [[nodiscard]] const Eigen::Vector3d& pivot() const { return pivot_; }

  // A point off the field costs as much as one beyond the robust scale: leaving must not pay.
  [[nodiscard]] NormalEquations evaluate(const Pose& pose) const {
    NormalEquations sum;
    PackedInformation information;
    const SensorInModel sensor(viewpoint_, pose);
    const bool asks_sensor = options_.only_facing && sensor.known();
    const double outlier_cost = loss_.value(loss_.scale * loss_.scale);
    const Eigen::Matrix3f rotation = pose.linear().cast<float>();
    const Eigen::Vector3f translation = pose.translation().cast<float>();
    for (const Eigen::Vector3f& point : points_) {
      const Eigen::Vector3f moved = rotation * point + translation;
      const model::DistanceField::Sample sample = model_.field->at(moved);
      if (!sample.known() || std::abs(sample.distance) >= loss_.scale ||
          (asks_sensor &&
           !sensor.is_turned(moved, model_.face_normals[static_cast<std::size_t>(sample.triangle)], kAway))) {
        sum.cost += outlier_cost;
        continue;
      }
      const FieldResidual r = field_residual(sample, moved.cast<double>(), pivot_);
      const double squared = r.value * r.value;
      const double weight = loss_.weight(squared);
      information.add(r.derivative, weight);
      sum.gradient += weight * r.value * r.derivative;
      sum.cost += loss_.value(squared);
      sum.squared += squared;
      ++sum.inliers;
    }
    sum.information = information.matrix();
    return sum;
  }

 private:
  std::span<const Eigen::Vector3f> points_;
  const model::PreparedModel& model_;
  const scan::Viewpoint& viewpoint_;
  const LmIcpOptions& options_;
  TukeyLoss loss_;
  Eigen::Vector3d pivot_;
};

// Directions that nothing holds (sliding along a plane) get no step instead of a huge one.
Vector6d damped_step(const NormalEquations& equations, double damping) {
  Matrix6d system = equations.information;
  const Vector6d diagonal = system.diagonal();
  system.diagonal() += damping * diagonal + Vector6d::Constant(1e-9 * diagonal.maxCoeff() + 1e-12);
  return -solve_symmetric(system, equations.gradient);
}

}  // namespace

FieldResidual field_residual(const model::DistanceField::Sample& sample, const Eigen::Vector3d& point_in_model,
                             const Eigen::Vector3d& pivot_in_model) {
  const Eigen::Vector3d gradient = sample.gradient.cast<double>();
  FieldResidual result;
  result.value = static_cast<double>(sample.distance);
  result.derivative << (point_in_model - pivot_in_model).cross(gradient), gradient;
  return result;
}

Pose stepped(const Pose& model_from_scan, const Vector6d& twist, const Eigen::Vector3d& pivot_in_model) {
  return Eigen::Translation3d(pivot_in_model) * pose_from_twist(twist) * Eigen::Translation3d(-pivot_in_model) *
         model_from_scan;
}

LmIcpResult lm_icp(std::span<const Eigen::Vector3f> points_in_scan, const Pose& model_from_scan,
                   const model::PreparedModel& model, const scan::Viewpoint& viewpoint, const LmIcpOptions& options) {
  const Problem problem(points_in_scan, model, viewpoint, options);
  const double lever = 0.5 * model.diameter;
  LmIcpResult result;
  result.model_from_scan = model_from_scan;
  NormalEquations current = problem.evaluate(model_from_scan);
  double damping = 1e-3;
  for (result.iterations = 0; result.iterations < options.max_iterations; ++result.iterations) {
    if (current.inliers < 6) break;
    const Vector6d step = damped_step(current, damping);
    const double motion = step.head<3>().norm() * lever + step.tail<3>().norm();
    if (!step.allFinite()) break;
    const Pose trial = stepped(result.model_from_scan, step, problem.pivot());
    const NormalEquations next = problem.evaluate(trial);
    if (next.cost < current.cost) {
      result.model_from_scan = trial;
      current = next;
      damping = std::max(1e-7, 0.2 * damping);
      if (motion < 1e-3 * options.robust_scale_mm) break;
    } else {
      damping *= 10.0;
      if (damping > 1e4 || motion < 1e-4 * options.robust_scale_mm) break;
    }
  }
  result.model_from_scan = orthonormalised(result.model_from_scan);
  result.inliers = current.inliers;
  result.rms_mm = current.inliers == 0 ? 0.0 : std::sqrt(current.squared / static_cast<double>(current.inliers));
  return result;
}

}  // namespace asbuilt::verify
