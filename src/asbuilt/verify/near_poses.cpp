// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/verify/near_poses.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

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
      if (distance(point) <= distance_) on_model_.push_back(point);
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
    for (const Eigen::Matrix3d& rotation : cube_rotations()) {
      Eigen::AlignedBox3d seen;
      for (const Eigen::Vector3f& point : on_model_) seen.extend(rotation * point.cast<double>());
      for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector3d shift;
        for (int axis = 0; axis < 3; ++axis) {
          const bool is_high = ((corner >> axis) & 1) != 0;
          shift[axis] = is_high ? model_.box.max()[axis] - seen.max()[axis] : model_.box.min()[axis] - seen.min()[axis];
        }
        Pose motion = Pose::Identity();
        motion.linear() = rotation;
        motion.translation() = shift;
        const double share = share_that_stays(motion);
        if (share >= kStayingShare && makes_another_pose(motion)) turned.push_back({motion, share});
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

  [[nodiscard]] float distance(const Eigen::Vector3f& point_in_model) const {
    return std::abs(model_.field->distance_at(point_in_model));
  }

  [[nodiscard]] double share_that_stays(const Pose& motion) const {
    const Eigen::Isometry3f moved = motion.cast<float>();
    const auto stays = [&](const Eigen::Vector3f& point) { return distance(moved * point) <= 2.0F * distance_; };
    return static_cast<double>(std::ranges::count_if(on_model_, stays)) / static_cast<double>(on_model_.size());
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
  const Eigen::MatrixXd q = Eigen::HouseholderQR<Eigen::MatrixXd>(columns).householderQ();
  const Eigen::MatrixXd held = q.rightCols(6 - columns.cols());
  const Eigen::MatrixXd information = held.transpose() * evidence.information * held;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(information, Eigen::EigenvaluesOnly);
  return std::max(0.0, solver.eigenvalues()[0]) / static_cast<double>(evidence.explained_samples);
}

bool turns_are_nearly_equal(const model::PreparedModel& model, double ratio) {
  constexpr int kTurns = 7;
  constexpr double kGolden = 0.381966011250105;  // of a turn, so that no order of a symmetry divides them all
  const auto limit = static_cast<float>(ratio * model.diameter);
  for (const model::NearAxis& axis : model.symmetry.near_axes) {
    for (int i = 1; i <= kTurns; ++i) {
      const Eigen::Isometry3f turn =
          model::rotation_about(axis.axis, axis.point, 2.0 * kPi * kGolden * i).inverse().cast<float>();
      const auto leaves = [&](const Eigen::Vector3f& sample) {
        return std::abs(model.field->distance_at(turn * sample)) > limit;
      };
      if (std::ranges::any_of(model.dense_samples.positions, leaves)) return false;
    }
  }
  return !model.symmetry.near_axes.empty();
}

}  // namespace asbuilt::verify
