// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <iterator>
#include <memory>
#include <vector>

#include "asbuilt/core/context.h"

namespace asbuilt {

/// The threads of a Context. The only door to TBB (or to plain threads, for the thread sanitizer, which
/// cannot see into the packaged TBB: build with ASBUILT_PLAIN_THREADS).
class ThreadArena {
 public:
  explicit ThreadArena(int threads);
  ~ThreadArena();
  ThreadArena(const ThreadArena&) = delete;
  ThreadArena& operator=(const ThreadArena&) = delete;

  [[nodiscard]] int threads() const { return threads_; }

  /// Calls task(block) for every block in [0, blocks), in any order, on all threads; nested calls are fine.
  /// An exception from a task is rethrown here.
  void run_blocks(std::size_t blocks, const std::function<void(std::size_t)>& task);

 private:
  struct Implementation;
  int threads_;
  std::unique_ptr<Implementation> implementation_;
};

/// Calls body(i) for i in [0, count), `grain` indices at a time. Each index must write only its own slot;
/// then the result does not depend on the number of threads.
template <class Body>
void parallel_for(const Context& context, std::size_t count, std::size_t grain, const Body& body) {
  const std::size_t blocks = (count + grain - 1) / grain;
  context.arena().run_blocks(blocks, [&](std::size_t block) {
    const std::size_t end = std::min(count, (block + 1) * grain);
    for (std::size_t i = block * grain; i < end; ++i) body(i);
  });
}

/// As parallel_for, but body(begin, end) gets a whole block, for scratch memory that lives as long as it.
template <class Body>
void parallel_for_blocks(const Context& context, std::size_t count, std::size_t grain, const Body& body) {
  const std::size_t blocks = (count + grain - 1) / grain;
  context.arena().run_blocks(
      blocks, [&](std::size_t block) { body(block * grain, std::min(count, (block + 1) * grain)); });
}

/// Adds up over [0, count) in an order fixed by `count` and `grain` alone: add(sum, i) within a block,
/// then the blocks' sums with += in their order.
template <class T, class Add>
T sum_in_fixed_order(const Context& context, std::size_t count, std::size_t grain, const T& zero, const Add& add) {
  const std::size_t blocks = (count + grain - 1) / grain;
  std::vector<T> partial(blocks, zero);
  context.arena().run_blocks(blocks, [&](std::size_t block) {
    const std::size_t end = std::min(count, (block + 1) * grain);
    T sum = zero;
    for (std::size_t i = block * grain; i < end; ++i) add(sum, i);
    partial[block] = sum;
  });
  T total = zero;
  for (const T& sum : partial) total += sum;
  return total;
}

/// Stable merge sort; a total order in `before` is still the better habit.
template <class T, class Before>
void stable_parallel_sort(const Context& context, std::vector<T>& values, const Before& before) {
  constexpr std::size_t kRun = 1 << 15;
  const std::size_t count = values.size();
  parallel_for_blocks(context, count, kRun, [&](std::size_t begin, std::size_t end) {
    std::stable_sort(values.begin() + static_cast<std::ptrdiff_t>(begin),
                     values.begin() + static_cast<std::ptrdiff_t>(end), before);
  });
  std::vector<T> merged(values.size());
  for (std::size_t width = kRun; width < count; width *= 2) {
    parallel_for_blocks(context, count, 2 * width, [&](std::size_t begin, std::size_t end) {
      const auto at = [&](std::size_t i) { return values.begin() + static_cast<std::ptrdiff_t>(std::min(i, count)); };
      std::merge(at(begin), at(begin + width), at(begin + width), at(end),
                 merged.begin() + static_cast<std::ptrdiff_t>(begin), before);
    });
    values.swap(merged);
  }
}

}  // namespace asbuilt
