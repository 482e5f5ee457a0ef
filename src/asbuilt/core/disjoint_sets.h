// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace asbuilt {

/// Union-find over 0..size-1 with online insertion. The smallest member is the root, so results do not
/// depend on the order of the unions.
class DisjointSets {
 public:
  explicit DisjointSets(int size = 0) : parent_(static_cast<std::size_t>(size)), count_(size) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  /// Adds one element, alone in its set; gives its index.
  int add() {
    parent_.push_back(static_cast<int>(parent_.size()));
    ++count_;
    return parent_.back();
  }

  [[nodiscard]] int find(int element) {
    int root = element;
    while (parent_[at(root)] != root) root = parent_[at(root)];
    while (parent_[at(element)] != root) element = std::exchange(parent_[at(element)], root);
    return root;
  }

  /// Whether the two were in different sets before.
  bool unite(int first, int second) {
    const int a = find(first), b = find(second);
    if (a == b) return false;
    parent_[at(std::max(a, b))] = std::min(a, b);
    --count_;
    return true;
  }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] int size() const { return static_cast<int>(parent_.size()); }

  /// The sets, largest first (ties: the one with the smallest member first), members ascending.
  [[nodiscard]] std::vector<std::vector<int>> by_decreasing_size() {
    std::vector<std::vector<int>> members(parent_.size());
    for (int i = 0; i < size(); ++i) members[at(find(i))].push_back(i);
    std::erase_if(members, [](const std::vector<int>& set) { return set.empty(); });
    std::ranges::stable_sort(members, std::ranges::greater{}, &std::vector<int>::size);
    return members;
  }

 private:
  static std::size_t at(int index) { return static_cast<std::size_t>(index); }

  std::vector<int> parent_;
  int count_;
};

}  // namespace asbuilt
