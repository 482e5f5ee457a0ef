// SPDX-License-Identifier: Apache-2.0
#include <benchmark/benchmark.h>

#include <limits>
#include <vector>

#include "asbuilt/core/kd_tree.h"
#include "asbuilt/core/random.h"

namespace asbuilt::bench {
namespace {

// Points on a sphere of radius 100 mm: a surface, as scans are.
std::vector<Eigen::Vector3f> sphere(std::size_t count, std::uint64_t seed) {
  std::vector<Eigen::Vector3f> points;
  Random random(seed, "sphere", 0);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d direction(random.normal(), random.normal(), random.normal());
    points.push_back((100.0 * direction.normalized()).cast<float>());
  }
  return points;
}

void BM_KdTreeBuild(benchmark::State& state) {
  const auto points = sphere(static_cast<std::size_t>(state.range(0)), 1);
  for (auto _ : state) benchmark::DoNotOptimize(KdTree(points));
  state.SetItemsProcessed(state.iterations() * state.range(0));
}
BENCHMARK(BM_KdTreeBuild)->Arg(1'000)->Arg(30'000)->Arg(300'000)->Unit(benchmark::kMillisecond);

void BM_KdTreeNearest(benchmark::State& state) {
  const KdTree tree(sphere(static_cast<std::size_t>(state.range(0)), 1));
  const auto queries = sphere(4096, 2);
  std::size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(tree.nearest(queries[next++ % queries.size()]));
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_KdTreeNearest)->Arg(1'000)->Arg(30'000)->Arg(300'000);

// What the tree has to beat.
void BM_BruteForceNearest(benchmark::State& state) {
  const auto points = sphere(static_cast<std::size_t>(state.range(0)), 1);
  const auto queries = sphere(4096, 2);
  std::size_t next = 0;
  for (auto _ : state) {
    const Eigen::Vector3f& query = queries[next++ % queries.size()];
    float best = std::numeric_limits<float>::infinity();
    std::size_t best_index = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float distance = (points[i] - query).squaredNorm();
      if (distance < best) {
        best = distance;
        best_index = i;
      }
    }
    benchmark::DoNotOptimize(best_index);
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BM_BruteForceNearest)->Arg(1'000)->Arg(30'000);

}  // namespace
}  // namespace asbuilt::bench
