// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/kd_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "asbuilt/core/context.h"
#include "asbuilt/core/parallel.h"
#include "asbuilt/core/result.h"

namespace asbuilt {
namespace {

constexpr std::size_t kLeafSize = 8;

struct IndexedPoint {
  std::array<float, 3> place;
  std::uint32_t index;
};

/// A few points next to one another, axis by axis, so that their distances are found by vector instructions. Places
/// that are not taken are infinitely far.
struct Leaf {
  std::array<std::array<float, kLeafSize>, 3> place;
  std::array<std::uint32_t, kLeafSize> index;
};

/// A cut across one axis, or a leaf.
struct Node {
  static constexpr std::uint32_t kLeaf = 3;
  float left_end = 0.0F, right_start = 0.0F;  ///< along the axis; nothing lies between
  std::uint32_t axis = kLeaf;
  std::uint32_t other = 0;  ///< the right child (the left one follows its parent), or the leaf
};

struct Box {
  std::array<float, 3> low, high;
};

Box box_of(std::span<const IndexedPoint> points) {
  Box box{points.front().place, points.front().place};
  for (const IndexedPoint& point : points) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.low[axis] = std::min(box.low[axis], point.place[axis]);
      box.high[axis] = std::max(box.high[axis], point.place[axis]);
    }
  }
  return box;
}

std::size_t widest_axis(const Box& box) {
  std::size_t widest = 0;
  for (std::size_t axis = 1; axis < 3; ++axis) {
    if (box.high[axis] - box.low[axis] > box.high[widest] - box.low[widest]) widest = axis;
  }
  return widest;
}

// Rearranges the points so that those before the returned place are no further along the axis than the others. The
// middle of the box is the quicker cut; the median keeps the tree shallow whatever the points, and the leaves full.
std::size_t cut(std::span<IndexedPoint> points, std::size_t axis, float low, float high) {
  constexpr std::size_t kFullLeavesFrom = 8 * kLeafSize, kLeastShare = 8;
  if (points.size() > kFullLeavesFrom) {
    const float middle = 0.5F * low + 0.5F * high;
    const auto at = std::partition(points.begin(), points.end(),
                                   [&](const IndexedPoint& point) { return point.place[axis] < middle; });
    const auto left = static_cast<std::size_t>(at - points.begin());
    if (std::min(left, points.size() - left) >= points.size() / kLeastShare) return left;
  }
  const std::size_t leaves = (points.size() + kLeafSize - 1) / kLeafSize;
  const std::size_t median = leaves / 2 * kLeafSize;
  std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(median), points.end(),
                   [&](const IndexedPoint& a, const IndexedPoint& b) { return a.place[axis] < b.place[axis]; });
  return median;
}

// Squared distances are never negative, so their bit patterns are in the same order, and integers can be compared
// several at a time.
std::int32_t ordered_bits(float not_negative) { return std::bit_cast<std::int32_t>(not_negative); }

// One number to compare by: distance, then index.
std::uint64_t rank(const KdTree::Neighbour& neighbour) {
  return static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(neighbour.squared_distance)) << 32 | neighbour.index;
}

// What a search keeps. reach(): squared, inclusive; what is farther need not be offered, the rest in any order.

template <class Accept>
struct NearestOne {
  KdTree::Neighbour best;
  float limit;
  const Accept& accept;

  [[nodiscard]] float reach() const { return best.found() ? best.squared_distance : limit; }
  void offer(float distance, std::uint32_t index) {
    const KdTree::Neighbour offered{index, distance};
    if (rank(offered) < rank(best) && accept(index)) best = offered;
  }
};

struct NearestMany {
  std::vector<KdTree::Neighbour>& kept;  // sorted, nearest first
  std::size_t capacity;

  [[nodiscard]] float reach() const {
    return kept.size() == capacity ? kept.back().squared_distance : std::numeric_limits<float>::max();
  }
  void offer(float distance, std::uint32_t index) {
    const KdTree::Neighbour offered{index, distance};
    const std::uint64_t own = rank(offered);
    if (kept.size() < capacity) {
      kept.push_back(offered);
    } else if (own > rank(kept.back())) {
      return;
    }
    std::size_t place = kept.size() - 1;
    for (; place > 0 && own < rank(kept[place - 1]); --place) kept[place] = kept[place - 1];
    kept[place] = offered;
  }
};

struct AllWithin {
  std::vector<KdTree::Neighbour>& kept;
  float limit;

  [[nodiscard]] float reach() const { return limit; }
  void offer(float distance, std::uint32_t index) { kept.push_back({index, distance}); }
};

/// Nodes and leaves in the order in which they are made: a node, its left part, its right part.
struct Subtree {
  std::vector<Node> nodes;
  std::vector<Leaf> leaves;

  Box add(std::span<IndexedPoint> points) {
    leaves.reserve(points.size() / (kLeafSize / 2) + 1);
    nodes.reserve(2 * leaves.capacity());
    return add_below(points);
  }

  Box add_below(std::span<IndexedPoint> points) {
    const std::size_t own = nodes.size();
    nodes.emplace_back();
    const Box box = box_of(points);
    if (points.size() <= kLeafSize) {
      nodes[own].other = static_cast<std::uint32_t>(leaves.size());
      add_leaf(points);
      return box;
    }
    const std::size_t axis = widest_axis(box);
    const std::size_t left = cut(points, axis, box.low[axis], box.high[axis]);
    const float left_end = add_below(points.first(left)).high[axis];
    const auto right = static_cast<std::uint32_t>(nodes.size());
    const float right_start = add_below(points.subspan(left)).low[axis];
    nodes[own] = {left_end, right_start, static_cast<std::uint32_t>(axis), right};
    return box;
  }

  void add_leaf(std::span<const IndexedPoint> points) {
    Leaf& leaf = leaves.emplace_back();
    for (auto& coordinates : leaf.place) coordinates.fill(std::numeric_limits<float>::infinity());
    leaf.index.fill(KdTree::kNone);
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) leaf.place[axis][i] = points[i].place[axis];
      leaf.index[i] = points[i].index;
    }
  }

  void append(const Subtree& other) {
    const auto nodes_before = static_cast<std::uint32_t>(nodes.size());
    const auto leaves_before = static_cast<std::uint32_t>(leaves.size());
    for (Node node : other.nodes) {
      node.other += node.axis == Node::kLeaf ? leaves_before : nodes_before;
      nodes.push_back(node);
    }
    leaves.insert(leaves.end(), other.leaves.begin(), other.leaves.end());
  }
};

float squared_reach(float distance) {
  return std::isinf(distance) ? std::numeric_limits<float>::max() : distance * distance;
}

}  // namespace

struct KdTree::Implementation {
  /// Without a context, by the calling thread alone.
  Implementation(std::span<const Eigen::Vector3f> source, const Context* context) : count(source.size()) {
    constexpr std::size_t kFewest = 20000, kParts = 32;  // fewer points are not worth a thread
    std::vector<IndexedPoint> points = indexed(source);
    if (points.empty()) return;
    if (context == nullptr || count <= kFewest) {
      (void)tree.add(points);
      return;
    }
    std::vector<Part> parts;
    const std::size_t root = split(points, std::max(kFewest, count / kParts), parts);
    parallel_for(*context, parts.size(), 1, [&](std::size_t p) {
      Part& part = parts[p];
      if (part.left == kNoPart) part.box = part.subtree.add(part.points);
    });
    (void)join(root, parts);
  }

  static constexpr std::size_t kNoPart = std::numeric_limits<std::size_t>::max();

  /// A subtree that one thread builds, or a cut into two parts.
  struct Part {
    std::span<IndexedPoint> points;
    std::size_t left = kNoPart, right = kNoPart;
    std::size_t axis = 0;
    Box box{};
    Subtree subtree{};
  };

  static std::vector<IndexedPoint> indexed(std::span<const Eigen::Vector3f> source) {
    ASBUILT_EXPECT(source.size() < kNone, "fewer points than an index can tell apart");
    std::vector<IndexedPoint> points(source.size());
    for (std::size_t i = 0; i < source.size(); ++i) {
      points[i] = {{source[i].x(), source[i].y(), source[i].z()}, static_cast<std::uint32_t>(i)};
    }
    return points;
  }

  static std::size_t split(std::span<IndexedPoint> points, std::size_t most, std::vector<Part>& parts) {
    const std::size_t own = parts.size();
    parts.push_back({.points = points});
    if (points.size() <= most) return own;
    const Box box = box_of(points);
    const std::size_t axis = widest_axis(box);
    const std::size_t cut_at = cut(points, axis, box.low[axis], box.high[axis]);
    parts[own].box = box;
    parts[own].axis = axis;
    const std::size_t left = split(points.first(cut_at), most, parts);
    const std::size_t right = split(points.subspan(cut_at), most, parts);
    parts[own].left = left;
    parts[own].right = right;
    return own;
  }

  // Appends a part's nodes and leaves, in the order in which one thread would have made them.
  Box join(std::size_t at, const std::vector<Part>& parts) {
    const Part& part = parts[at];
    if (part.left == kNoPart) {
      tree.append(part.subtree);
      return part.box;
    }
    const std::size_t own = tree.nodes.size();
    tree.nodes.emplace_back();
    const float left_end = join(part.left, parts).high[part.axis];
    const auto right = static_cast<std::uint32_t>(tree.nodes.size());
    const float right_start = join(part.right, parts).low[part.axis];
    tree.nodes[own] = {left_end, right_start, static_cast<std::uint32_t>(part.axis), right};
    return part.box;
  }

  template <class ResultSet>
  void search(const Eigen::Vector3f& query, ResultSet& result) const {
    if (count > 0) search(0, {query.x(), query.y(), query.z()}, {0.0F, 0.0F, 0.0F}, result);
  }

  // `apart` is how far the query lies outside the node's box along each axis. Differences, squares and sums are rounded
  // as those of the points are, and rounding keeps their order: a bound is never above the distance of a point inside.
  template <class ResultSet>
  void search(std::uint32_t at, const std::array<float, 3>& query, std::array<float, 3> apart,
              ResultSet& result) const {
    while (tree.nodes[at].axis != Node::kLeaf) {
      const Node& node = tree.nodes[at];
      const float place = query[node.axis];
      std::array<float, 3> left = apart, right = apart;
      left[node.axis] = std::max(apart[node.axis], place - node.left_end);
      right[node.axis] = std::max(apart[node.axis], node.right_start - place);
      const bool left_first = left[node.axis] <= right[node.axis];
      const std::uint32_t nearer = left_first ? at + 1 : node.other, farther = left_first ? node.other : at + 1;
      if (is_within(left_first ? left : right, result)) search(nearer, query, left_first ? left : right, result);
      apart = left_first ? right : left;
      if (!is_within(apart, result)) return;
      at = farther;
    }
    search_leaf(tree.leaves[tree.nodes[at].other], query, result);
  }

  template <class ResultSet>
  static bool is_within(const std::array<float, 3>& apart, const ResultSet& result) {
    return apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2] <= result.reach();
  }

  template <class ResultSet>
  static void search_leaf(const Leaf& leaf, const std::array<float, 3>& query, ResultSet& result) {
    std::array<float, kLeafSize> distance;
    std::int32_t within = 0;
    const std::int32_t reach = ordered_bits(result.reach());
    for (std::size_t i = 0; i < kLeafSize; ++i) {
      const float x = query[0] - leaf.place[0][i], y = query[1] - leaf.place[1][i], z = query[2] - leaf.place[2][i];
      distance[i] = x * x + y * y + z * z;
      within += ordered_bits(distance[i]) <= reach ? 1 : 0;
    }
    for (std::size_t i = 0; within > 0; ++i) {
      if (ordered_bits(distance[i]) > reach) continue;
      --within;
      if (distance[i] <= result.reach()) result.offer(distance[i], leaf.index[i]);
    }
  }

  std::size_t count;
  Subtree tree;
};

KdTree::KdTree(std::span<const Eigen::Vector3f> points, const Context& context)
    : implementation_(std::make_unique<Implementation>(points, &context)) {}
KdTree::KdTree(std::span<const Eigen::Vector3f> points) : implementation_(std::make_unique<Implementation>(points, nullptr)) {}
KdTree::~KdTree() = default;
KdTree::KdTree(KdTree&&) noexcept = default;
KdTree& KdTree::operator=(KdTree&&) noexcept = default;

std::size_t KdTree::size() const { return implementation_->count; }

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
