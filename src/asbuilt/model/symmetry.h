// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "asbuilt/core/pose.h"

namespace asbuilt::model {

/// A motion that maps most of the surface onto itself, but for details that tell the two poses apart.
struct NearSymmetry {
  Pose motion = Pose::Identity();                       ///< model_from_model
  double share = 0.0;                                   ///< of the surface that comes to lie on itself
  Eigen::Vector3d breaks_at = Eigen::Vector3d::Zero();  ///< middle of the surface that does not
};

/// An axis about which any rotation is a near-symmetry (a screw but for its slot, a flange but for its holes).
struct NearAxis {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit length
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< on it
  double share = 0.0;                               ///< of the surface that comes to lie on itself, at the worst angle
};

/// The proper rotations that map the part onto itself, as far as a scan could tell (docs/model.md), in the model frame.
/// Poses g * model_from_scan, for g of the group, cannot be told apart: a pose is known modulo the group.
struct SymmetryGroup {
  enum class Kind {
    none,        ///< the identity alone
    discrete,    ///< `elements` are all
    revolution,  ///< any rotation about the axis, before each of `elements`
    sphere       ///< any rotation about the centre
  };

  Kind kind = Kind::none;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< a point that every element leaves in its place
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< of revolution, or that of highest order; unit length
  int order = 1;                                     ///< of a discrete group: n-fold about the axis
  std::vector<Pose> elements{Pose::Identity()};      ///< identity first; of a revolution also one that turns it over
  std::vector<NearSymmetry> near;                    ///< by decreasing share; different modulo the group
  std::vector<NearAxis> near_axes;                   ///< by decreasing share

  [[nodiscard]] bool is_trivial() const { return kind == Kind::none; }
  [[nodiscard]] bool has_near() const { return !near.empty() || !near_axes.empty(); }

  /// The element that comes closest to a motion of the model: that moves the corners of `box` nearly as it does.
  [[nodiscard]] Pose closest_element(const Pose& motion, const Eigen::AlignedBox3d& box) const;

  /// Of the poses g * model_from_scan the one with the smallest rotation angle; the same for any of them.
  [[nodiscard]] Pose canonical(const Pose& model_from_scan) const;

  [[nodiscard]] std::string describe() const;       ///< in words; "none" for the trivial group
  [[nodiscard]] std::string describe_near() const;  ///< in words; empty if there is no near-symmetry
};

/// Largest displacement of the corners of `box` by a motion, mm: a bound for every point in it.
[[nodiscard]] double largest_displacement_mm(const Pose& motion, const Eigen::AlignedBox3d& box);

/// The same for the motion from one pose to another modulo the group: 0 if they differ by one of its elements.
[[nodiscard]] double displacement_modulo_mm(const Pose& motion, const SymmetryGroup& group,
                                            const Eigen::AlignedBox3d& box);

/// Rotation by an angle (radians) about the line through `point` along the unit vector `axis`.
[[nodiscard]] Pose rotation_about(const Eigen::Vector3d& axis, const Eigen::Vector3d& point, double angle);

}  // namespace asbuilt::model
