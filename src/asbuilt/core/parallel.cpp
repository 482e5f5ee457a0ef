// SPDX-License-Identifier: Apache-2.0
#include "asbuilt/core/parallel.h"

#include <thread>

#ifdef ASBUILT_PLAIN_THREADS
#include <atomic>
#include <exception>
#include <mutex>
#else
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <optional>
#endif

namespace asbuilt {

Context::Context(int threads) : arena_(std::make_shared<ThreadArena>(threads)) {}

namespace {
int thread_count(int wanted) {
  return wanted > 0 ? wanted : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}
}  // namespace

#ifdef ASBUILT_PLAIN_THREADS

struct ThreadArena::Implementation {};

ThreadArena::ThreadArena(int threads) : threads_(thread_count(threads)) {}
ThreadArena::~ThreadArena() = default;

void ThreadArena::run_blocks(std::size_t blocks, const std::function<void(std::size_t)>& task) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto work = [&] {
    for (std::size_t block = next++; block < blocks; block = next++) {
      try {
        task(block);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (!failure) failure = std::current_exception();
        return;
      }
    }
  };
  const std::size_t helpers = blocks > 1 ? std::min(blocks, static_cast<std::size_t>(threads_)) - 1 : 0;
  std::vector<std::jthread> team;
  for (std::size_t i = 0; i < helpers; ++i) team.emplace_back(work);
  work();
  team.clear();
  if (failure) std::rethrow_exception(failure);
}

#else

struct ThreadArena::Implementation {
  explicit Implementation(int threads) {
    // TBB prints a warning, and gives fewer threads, unless it is told that more than the machine has are meant.
    if (threads > thread_count(0)) {
      limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    }
    arena.initialize(threads);
  }

  std::optional<tbb::global_control> limit;
  tbb::task_arena arena;
};

ThreadArena::ThreadArena(int threads)
    : threads_(thread_count(threads)), implementation_(std::make_unique<Implementation>(threads_)) {}
ThreadArena::~ThreadArena() = default;

void ThreadArena::run_blocks(std::size_t blocks, const std::function<void(std::size_t)>& task) {
  if (blocks == 0) return;
  if (blocks == 1 || threads_ == 1) {
    for (std::size_t block = 0; block < blocks; ++block) task(block);
    return;
  }
  implementation_->arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, blocks, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t block = range.begin(); block != range.end(); ++block) task(block);
        },
        tbb::simple_partitioner());
  });
}

#endif

}  // namespace asbuilt
