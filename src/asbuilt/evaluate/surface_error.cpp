// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/evaluate/surface_error.h"

#include <algorithm>
#include <cmath>

#include "asbuilt/core/matrix_factors.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"
#include "asbuilt/core/robust.h"

namespace asbuilt::evaluate {
namespace {

constexpr std::size_t kMaxPoints = 40000;
constexpr std::size_t kGrain = 512;
constexpr int kMaxSteps = 60;

struct MeanDistance {
  double sum = 0.0;
  std::size_t count = 0;
  MeanDistance& operator+=(const MeanDistance& other) {
    sum += other.sum;
    count += other.count;
    return *this;
  }
  [[nodiscard]] double value() const { return count == 0 ? 0.0 : sum / static_cast<double>(count); }
};

// Normal equations of one step and the loss before it.
struct Linearised {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d right_side = Vector6d::Zero();
  double loss = 0.0;
  Linearised& operator+=(const Linearised& other) {
    matrix += other.matrix;
    right_side += other.right_side;
    loss += other.loss;
    return *this;
  }
};

class Alignment {
 public:
  Alignment(std::vector<Eigen::Vector3d> points, const TriangleMesh& mesh, const model::SurfaceDistance& surface,
            double noise_mm, const Context& context)
      : points_(std::move(points)), mesh_(mesh), surface_(surface), loss_{noise_mm}, context_(context) {
    for (const Eigen::Vector3d& point : points_) centre_ += point / static_cast<double>(points_.size());
    for (const Eigen::Vector3d& point : points_) radius_ = std::max(radius_, (point - centre_).norm());
  }

  // Steps turn about the middle of the points under `motion`, so that rotation and translation hardly mix.
  [[nodiscard]] Linearised linearised(const Pose& motion) const {
    const Eigen::Vector3d middle = motion * centre_;
    return sum_in_fixed_order(context_, points_.size(), kGrain, Linearised{}, [&](Linearised& sum, std::size_t i) {
      const Eigen::Vector3d point = motion * points_[i];
      const auto nearest = surface_.nearest(point);
      const double distance = std::abs(nearest.signed_distance);
      // On the surface the way to it has no direction; the face's own will do.
      const Eigen::Vector3d direction = distance > 1e-9 * radius_
                                            ? Eigen::Vector3d((point - nearest.point) / distance)
                                            : doubled_area_vector(mesh_, nearest.triangle).normalized();
      Vector6d row;
      row << (point - middle).cross(direction), direction;
      const double weight = loss_.weight(distance * distance);
      sum.matrix += weight * row * row.transpose();
      sum.right_side -= weight * distance * row;
      sum.loss += loss_.value(distance * distance);
    });
  }

  [[nodiscard]] Pose stepped(const Pose& motion, const Linearised& system, double damping) const {
    Matrix6d damped = system.matrix;
    damped.diagonal() *= 1.0 + damping;
    damped.diagonal().array() += 1e-12 * system.matrix.trace();  // a plane or sphere leaves directions open
    const Eigen::Vector3d middle = motion * centre_;
    const Pose step = pose_from_twist(solve_symmetric(damped, system.right_side));
    return orthonormalised(Eigen::Translation3d(middle) * step * Eigen::Translation3d(-middle) * motion);
  }

  [[nodiscard]] double largest_move(const Pose& a, const Pose& b) const {
    return (a * centre_ - b * centre_).norm() + radius_ * (a.linear() - b.linear()).norm();
  }

  [[nodiscard]] Pose best(const Pose& start) const {
    Pose motion = start;
    Linearised system = linearised(motion);
    double damping = 1e-4;
    for (int step = 0; step < kMaxSteps && damping < 1e6; ++step) {
      if (context_.cancelled()) break;
      const Pose candidate = stepped(motion, system, damping);
      const Linearised there = linearised(candidate);
      if (!(there.loss < system.loss)) {
        damping *= 10.0;
        continue;
      }
      const double move = largest_move(motion, candidate);
      motion = candidate;
      system = there;
      damping = std::max(1e-9, 0.1 * damping);
      if (move < 1e-8 * radius_) break;
    }
    return motion;
  }

 private:
  std::vector<Eigen::Vector3d> points_;
  const TriangleMesh& mesh_;
  const model::SurfaceDistance& surface_;
  HuberLoss loss_;
  const Context& context_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double radius_ = 0.0;
};

template <class PointAt>
double mean_distance(std::size_t count, const PointAt& point_at, const model::SurfaceDistance& surface,
                     const Context& context) {
  return sum_in_fixed_order(context, count, kGrain, MeanDistance{},
                            [&](MeanDistance& sum, std::size_t i) {
                              const Eigen::Vector3d point = point_at(i);
                              if (!point.allFinite()) return;
                              sum.sum += std::abs(surface.nearest(point).signed_distance);
                              ++sum.count;
                            })
      .value();
}

}  // namespace

double mean_surface_distance(std::span<const Eigen::Vector3f> points_in_scan, const Pose& model_from_scan,
                             const model::SurfaceDistance& surface, const Context& context) {
  const auto at = [&](std::size_t i) { return Eigen::Vector3d(model_from_scan * points_in_scan[i].cast<double>()); };
  return mean_distance(points_in_scan.size(), at, surface, context);
}

double mean_surface_distance(std::span<const Eigen::Vector3d> points_in_model, const model::SurfaceDistance& surface,
                             const Context& context) {
  return mean_distance(
      points_in_model.size(), [&](std::size_t i) { return points_in_model[i]; }, surface, context);
}

Pose best_motion_onto(std::span<const Eigen::Vector3d> points_in_model, const TriangleMesh& mesh,
                      const model::SurfaceDistance& surface, double noise_mm, const Pose& start,
                      const Context& context) {
  ASBUILT_EXPECT(noise_mm > 0.0, "a positive noise");
  if (points_in_model.size() < 6 || mesh.empty()) return start;
  const std::size_t stride = (points_in_model.size() + kMaxPoints - 1) / kMaxPoints;
  std::vector<Eigen::Vector3d> chosen;
  for (std::size_t i = 0; i < points_in_model.size(); i += stride) chosen.push_back(points_in_model[i]);
  return Alignment(std::move(chosen), mesh, surface, noise_mm, context).best(start);
}

}  // namespace asbuilt::evaluate
