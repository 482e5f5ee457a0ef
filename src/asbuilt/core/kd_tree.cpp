// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/kd_tree.h"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <tuple>

namespace asbuilt {
namespace {

struct Points {
  std::vector<Eigen::Vector3f> values;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return values.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return values[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points, float, std::uint32_t>,
                                                 Points, 3, std::uint32_t>;

// nanoflann offers a candidate only if it is strictly nearer than the worst one kept. To let the lower index win a
// tie, the result sets below report the next larger float as their worst distance and compare for themselves.
float just_above(float value) { return std::nextafter(value, std::numeric_limits<float>::infinity()); }

bool is_better(float distance, std::uint32_t index, const KdTree::Neighbour& other) {
  return std::tie(distance, index) < std::tie(other.squared_distance, other.index);
}

template <class Accept>
struct NearestOne {
  using DistanceType = float;
  KdTree::Neighbour best;
  float reach;  // squared, inclusive
  const Accept& accept;

  [[nodiscard]] std::size_t size() const { return best.found() ? 1 : 0; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] float worstDist() const { return just_above(best.found() ? best.squared_distance : reach); }
  bool addPoint(float distance, std::uint32_t index) {
    const bool in_reach = distance <= reach;
    if (in_reach && (!best.found() || is_better(distance, index, best)) && accept(index)) best = {index, distance};
    return true;
  }
};

struct NearestMany {
  using DistanceType = float;
  std::vector<KdTree::Neighbour>& kept;  // sorted, nearest first
  std::size_t capacity;

  [[nodiscard]] std::size_t size() const { return kept.size(); }
  [[nodiscard]] bool full() const { return kept.size() == capacity; }
  [[nodiscard]] float worstDist() const {
    return full() ? just_above(kept.back().squared_distance) : std::numeric_limits<float>::infinity();
  }
  bool addPoint(float distance, std::uint32_t index) {
    if (full()) {
      if (!is_better(distance, index, kept.back())) return true;
      kept.pop_back();
    }
    const auto place = std::find_if(kept.begin(), kept.end(),
                                    [&](const KdTree::Neighbour& other) { return is_better(distance, index, other); });
    kept.insert(place, {index, distance});
    return true;
  }
};

struct AllWithin {
  using DistanceType = float;
  std::vector<KdTree::Neighbour>& kept;
  float reach;  // squared, inclusive

  [[nodiscard]] std::size_t size() const { return kept.size(); }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] float worstDist() const { return just_above(reach); }
  bool addPoint(float distance, std::uint32_t index) {
    if (distance <= reach) kept.push_back({index, distance});
    return true;
  }
};

// nanoflann adds up the distance to a cell from one float per level of the tree; rounding can carry it beyond the
// distance of a point inside, and a tied or nearest point is lost. This much slack covers a tree of any useful depth.
constexpr float kPruningSlack = -1e-5F;

float squared_reach(float distance) {
  return std::isinf(distance) ? std::numeric_limits<float>::max() : distance * distance;
}

}  // namespace

struct KdTree::Implementation {
  explicit Implementation(std::span<const Eigen::Vector3f> source)
      : points{{source.begin(), source.end()}}, tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(12)) {}

  template <class ResultSet>
  void search(const Eigen::Vector3f& query, ResultSet& result) const {
    if (!points.values.empty()) tree.findNeighbors(result, query.data(), nanoflann::SearchParams(32, kPruningSlack));
  }

  Points points;
  Tree tree;
};

KdTree::KdTree(std::span<const Eigen::Vector3f> points) : implementation_(std::make_unique<Implementation>(points)) {}
KdTree::~KdTree() = default;
KdTree::KdTree(KdTree&&) noexcept = default;
KdTree& KdTree::operator=(KdTree&&) noexcept = default;

std::size_t KdTree::size() const { return implementation_->points.values.size(); }

KdTree::Neighbour KdTree::nearest(const Eigen::Vector3f& query, float max_distance) const {
  const auto any = [](std::uint32_t) { return true; };
  NearestOne<decltype(any)> result{{}, squared_reach(max_distance), any};
  implementation_->search(query, result);
  return result.best;
}

KdTree::Neighbour KdTree::nearest_facing(const Eigen::Vector3f& query, float max_distance,
                                         std::span<const Eigen::Vector3f> directions, const Eigen::Vector3f& direction,
                                         float min_cosine) const {
  const auto faces = [&](std::uint32_t i) { return directions[i].dot(direction) > min_cosine; };
  NearestOne<decltype(faces)> result{{}, squared_reach(max_distance), faces};
  implementation_->search(query, result);
  return result.best;
}

void KdTree::nearest(const Eigen::Vector3f& query, std::size_t count, std::vector<Neighbour>& neighbours) const {
  neighbours.clear();
  if (count == 0) return;
  NearestMany result{neighbours, count};
  implementation_->search(query, result);
}

void KdTree::within(const Eigen::Vector3f& query, float radius, std::vector<Neighbour>& neighbours) const {
  neighbours.clear();
  AllWithin result{neighbours, squared_reach(radius)};
  implementation_->search(query, result);
  std::ranges::sort(neighbours, {}, &Neighbour::index);
}

}  // namespace asbuilt
