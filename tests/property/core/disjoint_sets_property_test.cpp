// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <utility>

#include "asbuilt/core/disjoint_sets.h"

namespace asbuilt {
namespace {

using Link = std::pair<int, int>;

// The components by repeated relabelling, which is too slow to be wrong.
std::vector<int> labels_by_relabelling(int size, const std::vector<Link>& links) {
  std::vector<int> label(static_cast<std::size_t>(size));
  std::iota(label.begin(), label.end(), 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [a, b] : links) {
      int& first = label[static_cast<std::size_t>(a)];
      int& second = label[static_cast<std::size_t>(b)];
      if (first == second) continue;
      first = second = std::min(first, second);
      changed = true;
    }
  }
  return label;
}

TEST(DisjointSetsProperty, AreTheComponentsWhateverTheOrderOfTheLinks) {
  constexpr int kSize = 60;
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> element(0, kSize - 1);
    std::vector<Link> links;
    for (unsigned i = 0; i < 10 + seed % 60; ++i) links.emplace_back(element(random), element(random));
    const std::vector<int> expected = labels_by_relabelling(kSize, links);

    std::ranges::shuffle(links, random);
    DisjointSets sets(kSize);
    for (const auto& [a, b] : links) sets.unite(a, b);
    std::map<int, int> sizes;
    for (int i = 0; i < kSize; ++i) {
      EXPECT_EQ(sets.find(i), expected[static_cast<std::size_t>(i)]) << "seed " << seed;
      ++sizes[expected[static_cast<std::size_t>(i)]];
    }
    EXPECT_EQ(sets.count(), static_cast<int>(sizes.size())) << "seed " << seed;
  }
}

}  // namespace
}  // namespace asbuilt
