// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/near_poses.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "asbuilt/core/matrix_factors.h"

namespace asbuilt::verify {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr std::size_t kMostTelling = 500;
constexpr double kStayingShare = 0.8;  // of the points on the model, which a near pose keeps there
constexpr int kAngles = 180;           // of a turn about a near axis
constexpr std::size_t kMostAngles = 6;

class NearPoses {
 public:
  NearPoses(const Pose& model_from_scan, std::span<const Eigen::Vector3f> points_in_scan,
            const model::PreparedModel& model, double distance_mm)
      : pose_(model_from_scan), model_(model), distance_(static_cast<float>(distance_mm)) {
    for (const Eigen::Vector3f& measured : points_in_scan) {
      const Eigen::Vector3f point = (pose_ * measured.cast<double>()).cast<float>();
      const auto on = model_.field->at(point);
      if (std::abs(on.distance) > distance_) continue;
      on_model_.push_back(point);
      outwards_.push_back(on.gradient);
    }
  }

  [[nodiscard]] std::vector<Pose> all() const {
    std::vector<Pose> poses;
    if (on_model_.empty()) return poses;
    for (const model::NearSymmetry& near : model_.symmetry.near) {
      if (share_that_stays(near.motion) >= kStayingShare) poses.push_back(near.motion * pose_);
    }
    for (const model::NearAxis& axis : model_.symmetry.near_axes) add_turns(axis, poses);
    return poses;
  }

  [[nodiscard]] std::vector<Pose> turned_in_box() const {
    constexpr std::size_t kMost = 24;
    struct Turned {
      Pose motion;
      double share;
    };
    std::vector<Turned> turned;
    const std::array<std::vector<double>, 3> faces = faces_of_model();
    for (const Eigen::Matrix3d& rotation : cube_rotations()) {
      std::array<std::vector<double>, 3> shifts;
      for (int axis = 0; axis < 3; ++axis) {
        shifts[static_cast<std::size_t>(axis)] = flush_shifts(rotation.row(axis), axis, faces);
      }
      for (const double x : shifts[0]) {
        for (const double y : shifts[1]) {
          for (const double z : shifts[2]) {
            Pose motion = Pose::Identity();
            motion.linear() = rotation;
            motion.translation() = Eigen::Vector3d(x, y, z);
            constexpr std::size_t kFew = 5;
            if (share_that_stays(motion, kFew) < kStayingShare - 0.1) continue;
            const double share = share_that_stays(motion);
            if (share >= kStayingShare && makes_another_pose(motion)) turned.push_back({motion, share});
          }
        }
      }
    }
    std::ranges::stable_sort(turned, std::ranges::greater{}, &Turned::share);
    std::vector<Pose> motions;
    for (const Turned& candidate : turned) {
      if (motions.size() == kMost) break;
      const bool is_new = std::ranges::all_of(
          motions, [&](const Pose& other) { return makes_another_pose(candidate.motion * other.inverse()); });
      if (is_new) motions.push_back(candidate.motion);
    }
    for (Pose& motion : motions) motion = motion * pose_;
    return motions;
  }

 private:
  // But for the identity.
  [[nodiscard]] static std::vector<Eigen::Matrix3d> cube_rotations() {
    std::vector<Eigen::Matrix3d> rotations;
    for (int x = 0; x < 6; ++x) {
      for (int y = 0; y < 6; ++y) {
        if (x / 2 == y / 2 || (x == 0 && y == 2)) continue;
        Eigen::Matrix3d rotation;
        rotation.col(0) = (x % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(x / 2);
        rotation.col(1) = (y % 2 == 0 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(y / 2);
        rotation.col(2) = rotation.col(0).cross(rotation.col(1));
        rotations.push_back(rotation);
      }
    }
    return rotations;
  }

  // Of the coordinates those around which most lie, within `distance_` on either side, and how many; ascending input.
  struct Crowd {
    double middle = 0.0;
    std::size_t count = 0;
  };
  [[nodiscard]] Crowd largest_crowd(const std::vector<float>& ascending) const {
    Crowd largest;
    double sum = 0.0;
    for (std::size_t begin = 0, end = 0; begin < ascending.size(); ++begin) {
      for (; end < ascending.size() && ascending[end] <= ascending[begin] + 2.0F * distance_; ++end) {
        sum += static_cast<double>(ascending[end]);
      }
      const std::size_t count = end - begin;
      if (count > largest.count) largest = {sum / static_cast<double>(count), count};
      sum -= static_cast<double>(ascending[begin]);
    }
    return largest;
  }

  // Where along each axis of the part's box flat faces lie across it, the largest first.
  [[nodiscard]] std::array<std::vector<double>, 3> faces_of_model() const {
    constexpr std::size_t kMostFaces = 4;
    constexpr double kLeastShare = 0.03;
    constexpr float kAcross = 0.97F;  // cosine
    const PointCloud& samples = model_.dense_samples;
    std::array<std::vector<double>, 3> faces;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      std::vector<float> coordinates;
      for (std::size_t i = 0; i < samples.size(); ++i) {
        if (std::abs(samples.normals[i][axis]) > kAcross) coordinates.push_back(samples.positions[i][axis]);
      }
      std::ranges::sort(coordinates);
      std::vector<double>& own = faces[static_cast<std::size_t>(axis)];
      while (own.size() < kMostFaces) {
        const Crowd face = largest_crowd(coordinates);
        if (static_cast<double>(face.count) < kLeastShare * static_cast<double>(samples.size())) break;
        own.push_back(face.middle);
        std::erase_if(coordinates, [&](float c) { return std::abs(c - static_cast<float>(face.middle)) <= distance_; });
      }
    }
    return faces;
  }

  // Shifts along an axis of the box that put the points on the model, turned, flush with its ends, or the face on which
  // most of them lie onto a face of the model. `direction`: the axis, turned back.
  [[nodiscard]] std::vector<double> flush_shifts(const Eigen::RowVector3d& direction, Eigen::Index axis,
                                                 const std::array<std::vector<double>, 3>& faces) const {
    constexpr double kFaceShare = 0.3;
    std::vector<float> seen;
    seen.reserve(on_model_.size());
    for (const Eigen::Vector3f& point : on_model_) seen.push_back(direction.cast<float>().dot(point));
    std::vector<double> shifts;
    if (seen.empty()) return shifts;
    std::ranges::sort(seen);
    const auto add = [&](double shift) {
      const bool is_new = std::ranges::all_of(
          shifts, [&](double other) { return std::abs(other - shift) > 0.5 * static_cast<double>(distance_); });
      if (is_new) shifts.push_back(shift);
    };
    add(model_.box.min()[axis] - static_cast<double>(seen.front()));
    add(model_.box.max()[axis] - static_cast<double>(seen.back()));
    const Crowd face = largest_crowd(seen);
    if (static_cast<double>(face.count) < kFaceShare * static_cast<double>(seen.size())) return shifts;
    for (const double other : faces[static_cast<std::size_t>(axis)]) add(other - face.middle);
    return shifts;
  }

  [[nodiscard]] float distance(const Eigen::Vector3f& point_in_model) const {
    return std::abs(model_.field->distance_at(point_in_model));
  }

  // Of every `step`-th point. What was seen from outside stays only on a face that looks the same way.
  [[nodiscard]] double share_that_stays(const Pose& motion, std::size_t step = 1) const {
    const Eigen::Isometry3f moved = motion.cast<float>();
    constexpr float kLooksAway = -0.5F;  // cosine
    const bool has_sides = !model_.is_open();
    std::size_t staying = 0, asked = 0;
    for (std::size_t i = 0; i < on_model_.size(); i += step, ++asked) {
      const auto there = model_.field->at(moved * on_model_[i]);
      const bool looks_away = has_sides && there.gradient.dot(moved.linear() * outwards_[i]) < kLooksAway;
      staying += !looks_away && std::abs(there.distance) <= 2.0F * distance_ ? 1U : 0U;
    }
    return static_cast<double>(staying) / static_cast<double>(asked);
  }

  // Those that leave the model at some turn; the others (a barrel) fit at every angle and tell nothing.
  [[nodiscard]] std::vector<Eigen::Vector3f> telling_points(const model::NearAxis& axis) const {
    constexpr int kTurns = 11;
    std::vector<std::uint8_t> tells(on_model_.size(), 0);
    for (int turn = 1; turn <= kTurns; ++turn) {
      const Eigen::Isometry3f moved =
          model::rotation_about(axis.axis, axis.point, 2.0 * kPi * (turn + 0.37) / (kTurns + 1.0)).cast<float>();
      for (std::size_t i = 0; i < on_model_.size(); ++i) {
        if (tells[i] == 0 && distance(moved * on_model_[i]) > 0.75F * distance_) tells[i] = 1;
      }
    }
    std::vector<Eigen::Vector3f> telling;
    for (std::size_t i = 0; i < on_model_.size(); ++i) {
      if (tells[i] != 0) telling.push_back(on_model_[i]);
    }
    const std::size_t step = telling.size() / kMostTelling + 1;
    std::vector<Eigen::Vector3f> thinned;
    for (std::size_t i = 0; i < telling.size(); i += step) thinned.push_back(telling[i]);
    return thinned;
  }

  [[nodiscard]] double fit(const std::vector<Eigen::Vector3f>& points, const Pose& motion) const {
    const Eigen::Isometry3f moved = motion.cast<float>();
    float sum = 0.0F;
    for (const Eigen::Vector3f& point : points) {
      sum += std::max(0.0F, 1.0F - distance(moved * point) / (3.0F * distance_));
    }
    return static_cast<double>(sum);
  }

  void add_turns(const model::NearAxis& axis, std::vector<Pose>& poses) const {
    const auto turned = [&](int i) { return model::rotation_about(axis.axis, axis.point, 2.0 * kPi * i / kAngles); };
    const std::vector<Eigen::Vector3f> telling = telling_points(axis);
    std::vector<double> fits(kAngles, 0.0);
    for (int i = 0; i < kAngles; ++i) fits[static_cast<std::size_t>(i)] = fit(telling, turned(i));
    std::vector<int> peaks;
    for (int i = 1; i < kAngles; ++i) {
      const auto at = [&](int k) { return fits[static_cast<std::size_t>((k + kAngles) % kAngles)]; };
      if (at(i) >= at(i - 1) && at(i) >= at(i + 1) && makes_another_pose(turned(i))) peaks.push_back(i);
    }
    std::ranges::sort(peaks, {}, [&](int i) { return std::pair(-fits[static_cast<std::size_t>(i)], i); });
    std::vector<Pose> chosen;
    for (const int i : peaks) {
      if (chosen.size() == kMostAngles) break;
      const bool is_new = std::ranges::none_of(
          chosen, [&](const Pose& other) { return !makes_another_pose(turned(i) * other.inverse()); });
      if (is_new) chosen.push_back(turned(i));
    }
    for (const Pose& motion : chosen) poses.push_back(motion * pose_);
  }

  // Whether a motion makes a pose that verification would hold apart.
  [[nodiscard]] bool makes_another_pose(const Pose& motion) const {
    constexpr double kApart = 0.05;  // of the diameter
    return model::displacement_modulo_mm(motion, model_.symmetry, model_.box) > kApart * model_.diameter;
  }

  const Pose& pose_;
  const model::PreparedModel& model_;
  float distance_;
  std::vector<Eigen::Vector3f> on_model_;  // in the model frame
  std::vector<Eigen::Vector3f> outwards_;  // the gradient of the distance there
};

// The twist of a turn about a line, as the rows of PoseEvidence::information measure it.
Vector6d twist_about(const Eigen::Vector3d& axis, const Eigen::Vector3d& point, const model::PreparedModel& model) {
  const Eigen::Vector3d centre = model.box.center();
  Vector6d twist;
  twist << axis, axis.cross(centre - point) / (0.5 * model.diameter);
  return twist;
}

}  // namespace

std::vector<Pose> near_poses(const Pose& model_from_scan, std::span<const Eigen::Vector3f> points_in_scan,
                             const model::PreparedModel& model, double distance_mm) {
  if (!model.symmetry.has_near()) return {};
  return NearPoses(model_from_scan, points_in_scan, model, distance_mm).all();
}

std::vector<Pose> turned_in_box(const Pose& model_from_scan, std::span<const Eigen::Vector3f> points_in_scan,
                                const model::PreparedModel& model, double distance_mm) {
  constexpr std::size_t kEnough = 1000;
  const auto few = points_in_scan.first(std::min(kEnough, points_in_scan.size()));
  return NearPoses(model_from_scan, few, model, distance_mm).turned_in_box();
}

std::vector<Vector6d> free_twists(const model::PreparedModel& model) {
  using Kind = model::SymmetryGroup::Kind;
  const model::SymmetryGroup& group = model.symmetry;
  std::vector<Vector6d> free;
  if (group.kind == Kind::revolution) free.push_back(twist_about(group.axis, group.centre, model).normalized());
  for (int i = 0; i < 3 && group.kind == Kind::sphere; ++i) {
    free.push_back(twist_about(Eigen::Vector3d::Unit(i), group.centre, model).normalized());
  }
  return free;
}

double weakest_direction(const PoseEvidence& evidence, const model::PreparedModel& model, bool near_too) {
  const model::SymmetryGroup& group = model.symmetry;
  std::vector<Vector6d> free = free_twists(model);
  // One is enough: two would leave a ball, which is no near-symmetry.
  if (near_too && free.empty() && !group.near_axes.empty()) {
    free.push_back(twist_about(group.near_axes.front().axis, group.near_axes.front().point, model));
  }
  if (free.empty() || evidence.explained_samples == 0) return evidence.weakest_direction();
  Eigen::MatrixXd columns(6, static_cast<Eigen::Index>(free.size()));
  for (std::size_t i = 0; i < free.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = free[i];
  const Eigen::MatrixXd q = orthogonal_basis(columns);
  const Eigen::MatrixXd held = q.rightCols(6 - columns.cols());
  const Eigen::MatrixXd information = held.transpose() * evidence.information * held;
  const double least = SymmetricEigen<Eigen::Dynamic>(information).eigenvalues()[0];
  return std::max(0.0, least) / static_cast<double>(evidence.explained_samples);
}

double surface_moved_mm(const Pose& motion, const model::PreparedModel& model) {
  const Eigen::Isometry3f moved = motion.cast<float>();
  float largest = 0.0F;
  for (const Eigen::Vector3f& sample : model.dense_samples.positions) {
    largest = std::max(largest, std::abs(model.field->distance_at(moved * sample)));
  }
  return static_cast<double>(largest);
}

bool turns_are_nearly_equal(const model::PreparedModel& model, double ratio) {
  constexpr int kTurns = 7;
  constexpr double kGolden = 0.381966011250105;  // of a turn, so that no order of a symmetry divides them all
  for (const model::NearAxis& axis : model.symmetry.near_axes) {
    for (int i = 1; i <= kTurns; ++i) {
      const Pose turn = model::rotation_about(axis.axis, axis.point, 2.0 * kPi * kGolden * i);
      if (surface_moved_mm(turn.inverse(), model) > ratio * model.diameter) return false;
    }
  }
  return !model.symmetry.near_axes.empty();
}

}  // namespace asbuilt::verify
