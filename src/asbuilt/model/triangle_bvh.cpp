// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/model/triangle_bvh.h"

#include <algorithm>
#include <numeric>

#include "asbuilt/core/result.h"

namespace asbuilt::model {
namespace {

using Box = Eigen::AlignedBox3f;

constexpr std::size_t kLeafSize = 2;
constexpr int kBins = 16;
constexpr int kMaxDepthOfHeuristic = 32;  // below, halves: their depth is the logarithm of what is left

float half_area(const Box& box) {
  if (box.isEmpty()) return 0.0F;
  const Eigen::Vector3f s = box.sizes();
  return s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
}

struct Range {
  std::size_t begin = 0, end = 0;
  Box box;

  [[nodiscard]] std::size_t size() const { return end - begin; }
};

struct Item {
  Box box;
  Eigen::Vector3f middle;
  std::uint32_t triangle;
};

struct Split {
  float cost = std::numeric_limits<float>::infinity();
  int axis = -1, bin = 0;
};

}  // namespace

class TriangleBvh::Builder {
 public:
  Builder(const TriangleMesh& mesh, TriangleBvh& bvh) : bvh_(bvh) {
    items_.reserve(mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) items_.push_back(item(mesh, i));
  }

  void run() {
    if (items_.empty()) return;
    Range all{0, items_.size(), {}};
    for (const Item& i : items_) all.box.extend(i.box);
    fill_node(add_node(), all, 0);
    bvh_.order_.reserve(items_.size());
    for (const Item& i : items_) bvh_.order_.push_back(i.triangle);
  }

 private:
  [[nodiscard]] Item item(const TriangleMesh& mesh, std::size_t i) const {
    Item result{Box(), {}, static_cast<std::uint32_t>(i)};
    for (int corner = 0; corner < 3; ++corner) {
      const int vertex = mesh.triangles[i][corner];
      ASBUILT_EXPECT(vertex >= 0 && static_cast<std::size_t>(vertex) < mesh.vertices.size(),
                     "triangle indices within the mesh");
      const Eigen::Vector3d& position = mesh.vertices[static_cast<std::size_t>(vertex)];
      ASBUILT_EXPECT(position.allFinite(), "finite mesh vertices");
      result.box.extend((position - bvh_.centre_).cast<float>());
    }
    result.middle = result.box.center();
    return result;
  }

  std::uint32_t add_node() {
    bvh_.nodes_.emplace_back();
    return static_cast<std::uint32_t>(bvh_.nodes_.size() - 1);
  }

  // Splits the range until there are four pieces or only leaves, always the widest piece next.
  void fill_node(std::uint32_t node, const Range& range, int depth) {
    std::vector<Range> pieces{range};
    while (pieces.size() < 4) {
      std::size_t widest = pieces.size();
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        if (pieces[i].size() <= kLeafSize) continue;
        if (widest == pieces.size() || half_area(pieces[i].box) > half_area(pieces[widest].box)) widest = i;
      }
      if (widest == pieces.size()) break;
      auto [left, right] = split(pieces[widest], depth);
      pieces[widest] = left;
      pieces.push_back(right);
    }
    for (std::size_t child = 0; child < 4; ++child) {
      const bool exists = child < pieces.size();
      const bool is_leaf = exists && pieces[child].size() <= kLeafSize;
      set_child(node, child, exists ? &pieces[child] : nullptr, is_leaf);
      if (!exists || is_leaf) continue;
      const std::uint32_t inner = add_node();
      bvh_.nodes_[node].first[child] = inner;
      fill_node(inner, pieces[child], depth + 1);
    }
  }

  void set_child(std::uint32_t node, std::size_t child, const Range* piece, bool is_leaf) {
    Node& target = bvh_.nodes_[node];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      const auto c = static_cast<Eigen::Index>(child);
      target.low[axis][c] = piece != nullptr ? piece->box.min()[a] : 0.0F;
      target.high[axis][c] = piece != nullptr ? piece->box.max()[a] : 0.0F;
    }
    target.count[child] = piece == nullptr ? kEmpty : is_leaf ? static_cast<std::uint32_t>(piece->size()) : 0;
    if (is_leaf) target.first[child] = static_cast<std::uint32_t>(piece->begin);
  }

  std::pair<Range, Range> split(const Range& range, int depth) {
    Box middles;
    for (std::size_t i = range.begin; i < range.end; ++i) middles.extend(items_[i].middle);
    const auto begin = items_.begin() + static_cast<std::ptrdiff_t>(range.begin);
    const auto end = items_.begin() + static_cast<std::ptrdiff_t>(range.end);
    auto boundary = begin + static_cast<std::ptrdiff_t>(range.size() / 2);
    const Split best = depth < kMaxDepthOfHeuristic ? cheapest_split(range, middles) : Split{};
    if (best.axis >= 0) {
      boundary =
          std::stable_partition(begin, end, [&](const Item& i) { return bin_of(i, middles, best.axis) <= best.bin; });
    } else {
      int axis = 0;
      middles.sizes().maxCoeff(&axis);
      std::nth_element(begin, boundary, end, [axis](const Item& a, const Item& b) {
        return std::pair(a.middle[axis], a.triangle) < std::pair(b.middle[axis], b.triangle);
      });
    }
    const std::size_t cut = range.begin + static_cast<std::size_t>(boundary - begin);
    return {bounded(range.begin, cut), bounded(cut, range.end)};
  }

  [[nodiscard]] Split cheapest_split(const Range& range, const Box& middles) const {
    Split best;
    for (int axis = 0; axis < 3; ++axis) {
      if (!(middles.sizes()[axis] > 0.0F)) continue;
      std::array<Box, kBins> boxes;
      std::array<std::size_t, kBins> counts{};
      for (std::size_t i = range.begin; i < range.end; ++i) {
        const auto bin = static_cast<std::size_t>(bin_of(items_[i], middles, axis));
        boxes[bin].extend(items_[i].box);
        ++counts[bin];
      }
      std::array<float, kBins> right_cost{};
      Box right;
      std::size_t right_count = 0;
      for (std::size_t bin = kBins - 1; bin > 0; --bin) {
        right.extend(boxes[bin]);
        right_count += counts[bin];
        right_cost[bin - 1] = half_area(right) * static_cast<float>(right_count);
      }
      Box left;
      std::size_t left_count = 0;
      for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
        left.extend(boxes[bin]);
        left_count += counts[bin];
        if (left_count == 0 || left_count == range.size()) continue;
        const float cost = half_area(left) * static_cast<float>(left_count) + right_cost[bin];
        if (cost < best.cost) best = {cost, axis, static_cast<int>(bin)};
      }
    }
    return best;
  }

  static int bin_of(const Item& item, const Box& middles, int axis) {
    const float share = (item.middle[axis] - middles.min()[axis]) / middles.sizes()[axis];
    return std::clamp(static_cast<int>(share * static_cast<float>(kBins)), 0, kBins - 1);
  }

  [[nodiscard]] Range bounded(std::size_t begin, std::size_t end) const {
    Range range{begin, end, {}};
    for (std::size_t i = begin; i < end; ++i) range.box.extend(items_[i].box);
    return range;
  }

  TriangleBvh& bvh_;
  std::vector<Item> items_;
};

TriangleBvh::TriangleBvh(const TriangleMesh& mesh) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  if (!box.isEmpty()) {
    centre_ = box.center();
    largest_coordinate_ = 0.5 * box.sizes().maxCoeff();
  }
  Builder(mesh, *this).run();
}

}  // namespace asbuilt::model
