// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "asbuilt/core/triangle_mesh.h"

namespace asbuilt::model {

/// Boxes around the triangles of a mesh, four children a node, for nearest-point searches. The four boxes of a node lie
/// side by side (structure of arrays), so that one pass of vector instructions bounds all of them.
/// Boxes are floats about the mesh's centre; the search widens its reach by their rounding, so nothing is missed.
class TriangleBvh {
 public:
  /// Splits by the surface area heuristic. Throws std::logic_error for non-finite vertices or a bad index.
  explicit TriangleBvh(const TriangleMesh& mesh);

  /// Triangle indices in the order of the leaves.
  [[nodiscard]] std::span<const std::uint32_t> order() const { return order_; }

  /// Calls visit(begin, end), a range of order(), for the leaves that can hold a point within reach, nearest box
  /// first; visit returns the squared reach that is left. No allocation.
  template <class Visit>
  void visit_nearest(const Eigen::Vector3d& point, double squared_reach, const Visit& visit) const;

 private:
  using Four = Eigen::Array<float, 4, 1>;
  struct Node {
    std::array<Four, 3> low, high;         // per axis, the four children
    std::array<std::uint32_t, 4> first{};  // node index, or begin of a leaf's range
    std::array<std::uint32_t, 4> count{};  // 0: inner node; kEmpty: no child
  };
  struct Pending {
    std::uint32_t first, count;
    float squared_distance;
  };
  static constexpr std::uint32_t kEmpty = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kMaxPending = 320;  // three siblings a level; the builder keeps the depth below 96

  class Builder;

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double largest_coordinate_ = 0.0;
};

template <class Visit>
void TriangleBvh::visit_nearest(const Eigen::Vector3d& point, double squared_reach, const Visit& visit) const {
  if (nodes_.empty()) return;
  const Eigen::Vector3d centred = point - centre_;
  const Eigen::Vector3f p = centred.cast<float>();
  const double rounding = 8.0 * static_cast<double>(std::numeric_limits<float>::epsilon()) *
                          (largest_coordinate_ + centred.cwiseAbs().maxCoeff());
  const auto widened = [rounding](double squared) {
    const double reach = std::sqrt(squared) * (1.0 + 1e-6) + rounding;
    return static_cast<float>(reach * reach * (1.0 + 1e-6));
  };
  float limit = widened(squared_reach);

  std::array<Pending, kMaxPending> pending;
  std::size_t size = 0;
  pending[size++] = {0, 0, 0.0F};
  while (size > 0) {
    const Pending next = pending[--size];
    if (next.squared_distance > limit) continue;
    if (next.count > 0) {
      squared_reach = visit(next.first, next.first + next.count);
      limit = widened(squared_reach);
      continue;
    }
    const Node& node = nodes_[next.first];
    Four squared = Four::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float x = p[static_cast<Eigen::Index>(axis)];
      const Four outside = (node.low[axis] - x).max(x - node.high[axis]).max(0.0F);
      squared += outside * outside;
    }
    // Pushed so that the nearest child lies on top.
    const std::size_t base = size;
    for (std::size_t child = 0; child < 4; ++child) {
      const float distance = squared[static_cast<Eigen::Index>(child)];
      if (node.count[child] == kEmpty || distance > limit) continue;
      std::size_t place = size++;
      while (place > base && pending[place - 1].squared_distance < distance) {
        pending[place] = pending[place - 1];
        --place;
      }
      pending[place] = {node.first[child], node.count[child], distance};
    }
  }
}

}  // namespace asbuilt::model
