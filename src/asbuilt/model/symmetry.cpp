// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/symmetry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace asbuilt::model {
namespace {

using Box = Eigen::AlignedBox3d;

Eigen::Vector3d corner(const Box& box, int i) { return box.corner(static_cast<Box::CornerType>(i)); }

// The rotation about an axis that moves the corners most nearly as `motion` does: sum |R(t) x - y|^2 over x from the
// axis and their images y is a constant less 2 (b cos t + c sin t).
Pose closest_turn(const Pose& motion, const Eigen::Vector3d& axis, const Eigen::Vector3d& point, const Box& box) {
  double b = 0.0, c = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d x = corner(box, i) - point, y = motion * corner(box, i) - point;
    b += (x - axis.dot(x) * axis).dot(y);
    c += axis.cross(x).dot(y);
  }
  return rotation_about(axis, point, b == 0.0 && c == 0.0 ? 0.0 : std::atan2(c, b));
}

// Of R(t) * rotation the one with the largest trace, hence the smallest angle; as above with columns for corners.
double turn_to_smallest_angle(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& axis) {
  double b = 0.0, c = 0.0;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d x = rotation.col(i), y = Eigen::Vector3d::Unit(i);
    b += (x - axis.dot(x) * axis).dot(y);
    c += axis.cross(x).dot(y);
  }
  return b == 0.0 && c == 0.0 ? 0.0 : std::atan2(c, b);
}

std::string in_words(const Eigen::Vector3d& axis) {
  // Not -0.00: the sign of a rounded zero says nothing.
  const auto rounded = [](double x) { return std::round(100.0 * x) / 100.0 + 0.0; };
  return fmt::format("({:.3g}, {:.3g}, {:.3g})", rounded(axis.x()), rounded(axis.y()), rounded(axis.z()));
}

}  // namespace

Pose rotation_about(const Eigen::Vector3d& axis, const Eigen::Vector3d& point, double angle) {
  Pose motion = Pose::Identity();
  motion.linear() = rotation_from_axis_angle(angle * axis);
  motion.translation() = point - motion.linear() * point;
  return motion;
}

double largest_displacement_mm(const Pose& motion, const Box& box) {
  double largest = 0.0;
  for (int i = 0; i < 8; ++i) largest = std::max(largest, (motion * corner(box, i) - corner(box, i)).norm());
  return largest;
}

double displacement_modulo_mm(const Pose& motion, const SymmetryGroup& group, const Box& box) {
  if (group.is_trivial()) return largest_displacement_mm(motion, box);
  return largest_displacement_mm(group.closest_element(motion, box).inverse() * motion, box);
}

Pose SymmetryGroup::closest_element(const Pose& motion, const Box& box) const {
  if (kind == Kind::sphere) {
    Pose turn = Pose::Identity();
    turn.linear() = motion.linear();
    turn.translation() = centre - turn.linear() * centre;
    return turn;
  }
  Pose best = Pose::Identity();
  double least = std::numeric_limits<double>::infinity();
  for (const Pose& element : elements) {
    Pose candidate = element;
    if (kind == Kind::revolution) candidate = closest_turn(motion * element.inverse(), axis, centre, box) * element;
    const double displacement = largest_displacement_mm(candidate.inverse() * motion, box);
    if (displacement >= least) continue;  // of equals the first
    least = displacement;
    best = candidate;
  }
  return best;
}

Pose SymmetryGroup::canonical(const Pose& model_from_scan) const {
  if (is_trivial()) return model_from_scan;
  if (kind == Kind::sphere) {
    Pose unturned = Pose::Identity();
    unturned.translation() = centre + model_from_scan.linear().transpose() * (model_from_scan.translation() - centre);
    return unturned;
  }
  Pose best = model_from_scan;
  double largest_trace = -std::numeric_limits<double>::infinity();
  for (const Pose& element : elements) {
    Pose candidate = element * model_from_scan;
    if (kind == Kind::revolution) {
      candidate = rotation_about(axis, centre, turn_to_smallest_angle(candidate.linear(), axis)) * candidate;
    }
    // Equal but for rounding: the first, so that it does not decide.
    if (candidate.linear().trace() <= largest_trace + 1e-9) continue;
    largest_trace = candidate.linear().trace();
    best = candidate;
  }
  return best;
}

std::string SymmetryGroup::describe() const {
  switch (kind) {
    case Kind::none:
      return "none";
    case Kind::sphere:
      return "any rotation about its centre";
    case Kind::revolution:
      return fmt::format("any rotation about {}{}", in_words(axis),
                         elements.size() > 1 ? ", and turned end for end" : "");
    case Kind::discrete:
      break;
  }
  const auto count = static_cast<int>(elements.size());
  const std::string fold = fmt::format("{}-fold about {}", order, in_words(axis));
  if (count == order) return fold;
  if (count == 2 * order) return fmt::format("{} and turned end for end, {} poses alike", fold, count);
  return fmt::format("{} and other axes, {} poses alike", fold, count);
}

std::string SymmetryGroup::describe_near() const {
  std::string words;
  for (const NearAxis& near_axis : near_axes) {
    words += fmt::format("{}{:.1f} % of the surface at any rotation about {}", words.empty() ? "" : "; ",
                         100.0 * near_axis.share, in_words(near_axis.axis));
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(near.size(), 3); ++i) {
    const Eigen::AngleAxisd turn(near[i].motion.linear());
    words += fmt::format("{}{:.1f} % of it turned by {:.0f} degrees about {}", words.empty() ? "" : "; ",
                         100.0 * near[i].share, turn.angle() * 180.0 / std::numbers::pi, in_words(turn.axis()));
  }
  if (near.size() > 3) words += fmt::format("; and {} more motions", near.size() - 3);
  return words;
}

}  // namespace asbuilt::model
