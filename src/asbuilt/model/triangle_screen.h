// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "asbuilt/model/sorted_triangle.h"

namespace asbuilt::model {

/// Tells of a few triangles which can be the nearest to a point of a small ball, by a bound from below on each
/// distance: the height over the plane, and how far the foot lies beyond the sides that it is beyond. Four triangles at
/// a time, in floats about the ball's centre; their rounding only lets a triangle more pass.
class TriangleScreen {
 public:
  /// All triangles and points that follow are looked at from `centre`. `reach_mm`: no point is further from the centre,
  /// and no triangle from a point.
  TriangleScreen(const Eigen::Vector3d& centre, double reach_mm) : centre_(centre), largest_mm_(reach_mm) {
    packets_.reserve(8);
  }

  void add(const SortedTriangle& t) {
    const std::size_t lane = count_++ % kLanes;
    if (lane == 0) packets_.emplace_back();
    Packet& packet = packets_.back();
    if (t.is_sliver) {  // its normal says nothing: always let through
      packet.height.set(lane, Eigen::Vector3d::Zero(), 0.0);
      for (Plane& side : packet.beyond) side.set(lane, Eigen::Vector3d::Zero(), 0.0);
      return;
    }
    const Eigen::Vector3d normal = t.normal.normalized();
    const std::array<Eigen::Vector3d, 3> corners{t.a - centre_, t.b - centre_, t.c - centre_};
    packet.height.set(lane, normal, -normal.dot(corners[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d outwards = (corners[(k + 1) % 3] - corners[k]).cross(normal).normalized();
      packet.beyond[k].set(lane, outwards, -outwards.dot(corners[k]));
      largest_mm_ = std::max(largest_mm_, corners[k].norm());
    }
  }

  /// Calls visit(i) for the i-th triangle added, for all that can be nearest to `point`, the likeliest first; visit
  /// returns the smallest squared distance so far, mm^2.
  template <class Visit>
  void visit_near(const Eigen::Vector3d& point, const Visit& visit) {
    const Eigen::Vector3f p = (point - centre_).cast<float>();
    std::size_t first = 0;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t k = 0; k < packets_.size(); ++k) {
      Packet& packet = packets_[k];
      const Four height = packet.height.at(p);
      const Four beyond = packet.beyond[0].at(p).max(packet.beyond[1].at(p)).max(packet.beyond[2].at(p)).max(0.0F);
      packet.squared_bound = height * height + beyond * beyond;
      const float smallest = packet.squared_bound.minCoeff();
      if (smallest >= least) continue;
      least = smallest;
      first = k * kLanes;
      while (packet.squared_bound[static_cast<Eigen::Index>(first % kLanes)] != smallest) ++first;
    }
    float limit = widened(visit(first));
    for (std::size_t k = 0; k < packets_.size(); ++k) {
      if (!(packets_[k].squared_bound <= limit).any()) continue;
      for (std::size_t i = k * kLanes; i < std::min(count_, (k + 1) * kLanes); ++i) {
        if (i == first || packets_[k].squared_bound[static_cast<Eigen::Index>(i % kLanes)] > limit) continue;
        limit = widened(visit(i));
      }
    }
  }

 private:
  static constexpr std::size_t kLanes = 4;
  using Four = Eigen::Array<float, 4, 1>;

  /// Four planes; signed distances to them.
  struct Plane {
    std::array<Four, 3> normal;
    Four offset;

    void set(std::size_t lane, const Eigen::Vector3d& unit_normal, double offset_mm) {
      const auto l = static_cast<Eigen::Index>(lane);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        normal[axis][l] = static_cast<float>(unit_normal[static_cast<Eigen::Index>(axis)]);
      }
      offset[l] = static_cast<float>(offset_mm);
    }
    [[nodiscard]] Four at(const Eigen::Vector3f& p) const {
      return normal[0] * p.x() + normal[1] * p.y() + normal[2] * p.z() + offset;
    }
  };
  struct Packet {
    Plane height;
    std::array<Plane, 3> beyond;
    Four squared_bound;

    Packet() {  // empty lanes are far away
      for (Plane* plane : {&height, &beyond[0], &beyond[1], &beyond[2]}) {
        plane->normal = {Four::Zero(), Four::Zero(), Four::Zero()};
        plane->offset = Four::Constant(1e18F);
      }
    }
  };

  /// A squared bound up to which a triangle can still be as near. A float product or sum of lengths up to L is off by
  /// no more than some ten roundings of L, and a bound holds two such sums.
  [[nodiscard]] float widened(double squared_mm2) const {
    constexpr double kRoundings = 64.0 * static_cast<double>(std::numeric_limits<float>::epsilon());
    const double distance = std::sqrt(squared_mm2) + kRoundings * largest_mm_;
    return static_cast<float>(distance * distance * (1.0 + kRoundings));
  }

  Eigen::Vector3d centre_;
  double largest_mm_ = 0.0;
  std::size_t count_ = 0;
  std::vector<Packet> packets_;
};

}  // namespace asbuilt::model
