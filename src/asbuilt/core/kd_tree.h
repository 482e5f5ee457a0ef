// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace asbuilt {

class Context;

/// Nearest neighbours among fixed points. Built once, then const and safe to query from any thread.
/// Equal distances go to the lower index. Copies the points; needs finite coordinates.
class KdTree {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  struct Neighbour {
    std::uint32_t index = kNone;  ///< kNone when nothing is within reach
    float squared_distance = std::numeric_limits<float>::infinity();

    [[nodiscard]] bool found() const { return index != kNone; }
  };

  explicit KdTree(std::span<const Eigen::Vector3f> points);
  /// The same tree, built by all threads.
  KdTree(std::span<const Eigen::Vector3f> points, const Context& context);
  ~KdTree();
  KdTree(KdTree&&) noexcept;
  KdTree& operator=(KdTree&&) noexcept;

  [[nodiscard]] std::size_t size() const;

  /// The nearest point no further than `max_distance`.
  [[nodiscard]] Neighbour nearest(const Eigen::Vector3f& query,
                                  float max_distance = std::numeric_limits<float>::infinity()) const;

  /// The nearest point no further than `max_distance` with dot(directions[i], direction) > min_cosine.
  /// `directions` has one entry a point (for example its normal).
  [[nodiscard]] Neighbour nearest_facing(const Eigen::Vector3f& query, float max_distance,
                                         std::span<const Eigen::Vector3f> directions, const Eigen::Vector3f& direction,
                                         float min_cosine) const;

  /// Fills `neighbours` with the up to `count` nearest, nearest first. Keeps the vector's memory.
  void nearest(const Eigen::Vector3f& query, std::size_t count, std::vector<Neighbour>& neighbours) const;

  /// Fills `neighbours` with all points no further than `radius`, by increasing index.
  void within(const Eigen::Vector3f& query, float radius, std::vector<Neighbour>& neighbours) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace asbuilt
